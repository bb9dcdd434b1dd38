"""One set of effects beside the nominal model, at its most probable parameters, with its evidence."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tauscope.diagnosis.evidence.bodies import BodyPrior, NormalBodies
from tauscope.diagnosis.evidence.linear_model import LinearModel, Posterior
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.fitting.fit import stepped
from tauscope.diagnosis.model.extended import STATED_ERROR, ExtendedModel, with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.identification import Identification
from tauscope.recording.recording import Array

SLOPE_SPREAD = 1.0
"""Standard deviation of the logarithm of a friction slope that the robot file does not state."""

SHAPE_SPREAD = 1.0
"""…of a shape that is searched by its logarithm."""

RANGE_SPREAD = 1.0 / np.sqrt(12.0)
"""…of another shape, relative to its range: that of a uniform distribution."""

LARGEST_LOG_STEP = 0.5
"""Change of a logarithm in one step: columns are straight over no more."""

LARGEST_SHAPE_STEP = 0.15
"""Change of another shape in one step, relative to its range."""

HALVINGS = (1.0, 0.5, 0.25, 0.1)
"""Parts of a step that are tried until the data are more probable."""

PROGRESS = 0.1
"""Gain in log probability below which a step is the last."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A model and what the data say of it.

    sizes : tuple of (c,) float64
        standard deviation believed of every term's coefficients
    scales : tuple of Scales
        one entry a joint
    """

    model: ExtendedModel
    sizes: tuple[Array, ...]
    linear: LinearModel
    bodies: NormalBodies
    scales: tuple[Scales, ...]

    @cached_property
    def posterior(self) -> Posterior:
        """Steps of all parameters from the model, and their covariance."""
        return self.linear.posterior(self.scales)

    @cached_property
    def log_evidence(self) -> float:
        """Log evidence of data and scales."""
        return self.posterior.log_evidence - sum(each.penalty() for each in self.scales)

    @cached_property
    def misfit(self) -> float:
        """-2 log probability of data and parameters as they are, but for what depends on the scales alone."""
        believed = float(self.linear.mean @ self.linear.precision @ self.linear.mean)
        pairs = zip(self.linear.joints, self.scales, strict=True)
        return believed + sum(float(own.weighted(scales).products[0, 0]) for own, scales in pairs)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is believed of a nominal model's parameters.

    friction : (f, f) float64
        precision of the friction coefficients about zero
    slopes, slope_spreads : (s,) float64
        logarithms of friction's slopes, and their standard deviations
    """

    bodies: BodyPrior
    friction: Array
    slopes: Array
    slope_spreads: Array

    @staticmethod
    def of(identification: Identification, model: ExtendedModel) -> "Prior":
        """That of an identification; its rotors, which are effects here, are left out."""
        structure, posterior = identification.structure, identification.posterior
        joints = range(structure.robot.joint_count)
        rotors = [structure.coefficient(joint, "rotor_inertia") for joint in joints]
        own = [place for place in range(structure.base_count, structure.size) if place not in rotors]
        covariance = np.linalg.inv(posterior.precision)[np.ix_(own, own)]
        spreads = [SLOPE_SPREAD if stated is None else STATED_ERROR for stated in model.stated]
        friction = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
        return Prior(BodyPrior.of(identification), friction, _slopes(model), np.array(spreads))


@dataclass(frozen=True, eq=False)
class Laboratory:
    """Makes hypotheses about the same rows."""

    rows: EvidenceRows
    prior: Prior

    def start(self, model: ExtendedModel) -> Hypothesis:
        """The nominal model with bodies that have volume, under scales of highest evidence."""
        links = self.prior.bodies.start(model.links)
        parameters = model.parameters.copy()
        count = len(self.prior.bodies.base)
        parameters[:count] = self.prior.bodies.base @ links
        nominal = replace(model, parameters=parameters, links=links)
        moments = self.rows.moments(nominal)
        levels = [float(np.sqrt(np.mean(own.rows[0] ** 2))) if own.rows.size else 1.0 for own in moments]
        return self.settle(self.at(nominal, (), tuple(map(Scales.start, levels))), range(len(levels)), rounds=2)

    def at(
        self, model: ExtendedModel, sizes: Sequence[Array], scales: Sequence[Scales], *, owned: bool = False
    ) -> Hypothesis:
        """A model as it is.

        Evidence asks whether an effect is more probable than torque without a name, which may look like it. Where an
        effect is `owned` it is believed, and no such torque takes a part of it.
        """
        bodies = self.prior.bodies.about(model.links)
        mean, precision = np.zeros(model.size), np.zeros((model.size, model.size))
        base, plain = len(bodies.mean), model.structure.size
        mean[:base] = bodies.mean - model.parameters[:base]
        precision[:base, :base] = bodies.precision
        mean[base:plain] = -model.parameters[base:]
        precision[base:plain, base:plain] = self.prior.friction
        spread = np.ones(model.size)
        slopes = slice(plain, plain + len(model.constants))
        mean[slopes], spread[slopes] = self.prior.slopes - _slopes(model), self.prior.slope_spreads
        for term, place, size in zip(model.terms, model.term_places(), sizes, strict=True):
            count = len(term.coefficients)
            mean[place.start : place.start + count] = -term.coefficients
            spread[place] = np.concatenate([size, _shape_spreads(term)])
        diagonal = np.arange(plain, model.size)
        precision[diagonal, diagonal] = 1.0 / spread[plain:] ** 2
        linear = LinearModel(self.rows.moments(model, owned=owned), mean, precision)
        return Hypothesis(model, tuple(sizes), linear, bodies, tuple(scales))

    def settle(self, start: Hypothesis, joints: Collection[int], *, rounds: int = 1, steps: int = 4) -> Hypothesis:
        """The most probable parameters, and scales of highest evidence at some joints."""
        at = start
        for _ in range(rounds):
            at = self.tune(at, joints)
            estimate = self.at(at.model, at.sizes, at.scales, owned=True)
            for _ in range(steps):
                nearer = self._nearer(estimate)
                if nearer is None:
                    break
                gained, estimate = estimate.misfit - nearer.misfit, nearer
                if gained < 2.0 * PROGRESS:
                    break
            at = self.at(estimate.model, at.sizes, at.scales)
        return self.tune(at, joints)

    def tune(self, at: Hypothesis, joints: Collection[int]) -> Hypothesis:
        """The same model under scales of highest evidence."""
        return replace(at, scales=at.linear.most_probable(at.scales, joints))

    def _nearer(self, at: Hypothesis) -> Hypothesis | None:
        """The model after a step under which data and parameters are more probable; None where there is none."""
        step = _limit(at.model, at.posterior.mean)
        base = len(at.bodies.mean)
        links = at.bodies.links(at.model.parameters[:base] + step[:base]) - at.model.links
        whole = self.prior.bodies.share(at.model.links, links)
        for part in HALVINGS:
            moved = replace(stepped(at.model, part * whole * step), links=at.model.links + part * whole * links)
            found = self.at(moved, at.sizes, at.scales, owned=True)
            if found.misfit < at.misfit:
                return found
        return None

    def with_term(self, at: Hypothesis, term: Term, size: Array) -> Hypothesis:
        """A model with one effect more, as it is.

        Parameters
        ----------
        size : (c,) float64
            standard deviation believed of its coefficients
        """
        return self.at(with_terms(at.model, [*at.model.terms, term]), [*at.sizes, size], at.scales)

    def without_term(self, at: Hypothesis, place: int) -> Hypothesis:
        """A model with one effect less, as it is.

        Parameters
        ----------
        place : int
            of the effect among the model's terms
        """
        terms = [term for at_place, term in enumerate(at.model.terms) if at_place != place]
        sizes = [size for at_place, size in enumerate(at.sizes) if at_place != place]
        return self.at(with_terms(at.model, terms), sizes, at.scales)


def _slopes(model: ExtendedModel) -> Array:
    """Logarithms of friction's slopes, (s,)."""
    return np.log([model.constant(place) for place in range(len(model.constants))])


def _shape_spreads(term: Term) -> Array:
    """Standard deviations believed of a term's free shapes, (f,)."""
    effect = term.effect
    return np.array(
        [
            SHAPE_SPREAD * abs(float(term.shape[place]))
            if effect.shapes[place].logarithmic
            else RANGE_SPREAD * float(effect.upper[place] - effect.lower[place])
            for place in term.free_shapes
        ]
    )


def _limit(model: ExtendedModel, step: Array) -> Array:
    """A step whose curved parameters stay where their columns are straight."""
    limited, first = step.copy(), model.structure.size
    slopes = slice(first, first + len(model.constants))
    limited[slopes] = np.clip(step[slopes], -LARGEST_LOG_STEP, LARGEST_LOG_STEP)
    for term, place in zip(model.terms, model.term_places(), strict=True):
        effect = term.effect
        reach = np.array(
            [
                LARGEST_LOG_STEP * abs(float(term.shape[free]))
                if effect.shapes[free].logarithmic
                else LARGEST_SHAPE_STEP * float(effect.upper[free] - effect.lower[free])
                for free in term.free_shapes
            ]
        )
        shapes = slice(place.start + len(term.coefficients), place.stop)
        limited[shapes] = np.clip(step[shapes], -reach, reach)
    return limited
