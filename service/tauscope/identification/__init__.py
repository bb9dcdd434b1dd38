"""Parameters from recordings: terms, noise, LS and WLS, uncertainty, physical consistency, compensation."""

from tauscope.identification.estimate import Estimator
from tauscope.identification.identification import Identification, Options, identify
from tauscope.identification.result import IdentificationDocument, document

__all__ = ["Estimator", "Identification", "IdentificationDocument", "Options", "document", "identify"]
