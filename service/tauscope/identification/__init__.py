"""Parameters from recordings: terms, noise, LS and WLS, uncertainty, physical consistency, compensation."""

from tauscope.identification.identification import Identification, Options, identify
from tauscope.identification.least_squares import Estimator
from tauscope.identification.result import IdentificationDocument, document

__all__ = ["Estimator", "Identification", "IdentificationDocument", "Options", "document", "identify"]
