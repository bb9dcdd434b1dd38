"""A warning in a result: something about the data that the reader must know before the numbers."""

from pydantic import Field

from tauscope.strict_model import ResultModel


class ResultWarning(ResultModel):
    """One warning. Its code is stable and has a page, ``docs/warnings/CODE.md``."""

    code: str = Field(description="stable name, which has a page in docs/warnings")
    joint: str | None = Field(default=None, description="name of the joint; null where it concerns the whole arm")
    text: str = Field(description="what was found, with the evidence")
    remedy: str | None = Field(default=None, description="what to do about it")

    @property
    def sentence(self) -> str:
        """Text and remedy."""
        return f"{self.text}; {self.remedy}" if self.remedy else self.text
