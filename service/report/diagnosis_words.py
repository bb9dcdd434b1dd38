"""A diagnosis in words and tables, the same on terminal and page."""

from service.diagnosis import DiagnosisDocument
from service.report.quantities import significant
from service.report.table import Table

VERDICTS = {
    "consistent": "nothing but noise is left",
    "explained": "the findings bring the residual to the noise",
    "partly_explained": "the findings improve the fit, and a significant remainder stays",
    "unexplained": "a significant mismatch that nothing in the catalogue explains",
    "inconclusive": "the parameters do not hold from one recording to the next, and nothing can be named",
}

MOST_SHIFTS = 12


def residual_table(document: DiagnosisDocument) -> Table:
    """Residuals before and after, on training and held-out recordings.

    Parameters
    ----------
    document : DiagnosisDocument
        the result
    """
    train, held_out = document.fit.train, document.fit.held_out
    columns = ["joint", "before", "after"]
    values = [train.rms_before, train.rms_after]
    if held_out is not None:
        columns += ["held out before", "held out after"]
        values += [held_out.rms_before, held_out.rms_after]
    rows = [(name, *(significant(row[place], 3) for row in values)) for place, name in enumerate(document.joints)]
    return Table(tuple(columns), rows, words=1)


def difference_table(document: DiagnosisDocument) -> Table:
    """What the simulation has wrong.

    Parameters
    ----------
    document : DiagnosisDocument
        the result
    """
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.simulation, e.real)), significant(e.difference_in_std, 3))
        for e in document.parameter_differences
    ]
    return Table(("parameter", "simulation", "arm", "standard errors"), rows, words=1)


def shift_table(document: DiagnosisDocument) -> Table:
    """What the left-out effects had done to the parameters.

    Parameters
    ----------
    document : DiagnosisDocument
        the result
    """
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.before, e.after)), significant(e.shift_in_std, 3))
        for e in document.parameter_shifts[:MOST_SHIFTS]
    ]
    return Table(("parameter", "before", "after", "standard errors"), rows, words=1)
