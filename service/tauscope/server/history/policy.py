"""The bounds by which a new model is judged, and beyond which a change is told."""

from typing import Annotated

from pydantic import Field, FiniteFloat

from tauscope.identification.result import Document

Ratio = Annotated[FiniteFloat, Field(ge=1.0)]
Positive = Annotated[FiniteFloat, Field(gt=0.0)]


class ModelPolicy(Document):
    """Bounds for one robot."""

    held_out_error: Positive = Field(
        default=0.2, description="largest relative error on held-out recordings with which a model may become active"
    )
    held_out_ratio: Ratio = Field(
        default=1.5, description="largest residual on held-out recordings, in residuals of the training (or its noise)"
    )
    consistency_ratio: Ratio = Field(
        default=1.2, description="largest residual of the physically consistent model, in residuals of the best one"
    )
    condition_number: Ratio = Field(default=500.0, description="largest condition number of the regressor")
    drift_std: Positive = Field(
        default=6.0, description="change of a parameter beyond which it is told, in joint standard errors"
    )
    drift_share: Positive = Field(
        default=0.25, description="and in parts of its earlier value: both bounds have to be passed"
    )
