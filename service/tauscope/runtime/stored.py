"""What a run keeps as JSON: strict models."""

from pydantic import BaseModel, ConfigDict


class StoredModel(BaseModel):
    """Base of what runs keep as JSON: no type is converted, no key is overlooked."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)
