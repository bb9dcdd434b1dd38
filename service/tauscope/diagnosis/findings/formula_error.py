"""What may be no effect of its own, but the error of another's formula.

No arm follows a formula exactly. Beside a law of energy E at a joint, an error of energy s E is left, √s ~ N(0, σ²).
An effect of r times the energy of the others' laws at its joints is such an error with chance

    P(s ≥ r) = erfc(√(r / 2σ²)),   σ² = `FORMULA_ERROR`.

That every formula has an error is certain before the data, and that this effect is missing is one of as many cases as
there are effects and joints: the odds of the error against the effect are P times their number.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import erfc

from tauscope.diagnosis.findings.finding import EQUIVALENT, FORMULA_ERROR, Finding


def doubt_formulas(findings: Sequence[Finding], sites: int) -> list[Finding]:
    """Findings of one model, each as probable as the others' formulas allow. `sites`: effects times joints."""
    laws = [each for each in findings if not each.terms[0].effect.is_expected]
    return [_doubt(each, [law for law in laws if law is not each], sites) for each in findings]


def _doubt(finding: Finding, laws: Sequence[Finding], sites: int) -> Finding:
    own = finding.relative_energy
    beside = [np.where(finding.is_own, law.relative_energy, 0.0) for law in laws]
    energy = float(np.max(beside, axis=0, initial=0.0).sum())
    if energy == 0.0:
        return finding
    chance = float(erfc(np.sqrt(0.5 * own.sum() / energy / FORMULA_ERROR)))
    odds = chance * (1 if finding.terms[0].effect.is_expected else sites)
    if odds < np.exp(-EQUIVALENT):
        return finding
    law = laws[int(np.sum(beside, axis=1).argmax())].terms[0].effect
    return replace(finding, probability=1.0 / (1.0 / finding.probability + odds), formula=law)
