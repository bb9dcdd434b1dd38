"""Identifications: what is special about this resource."""

from tauscope.identification import IdentificationDocument
from tauscope.report.identification_plots import IdentificationPlots
from tauscope.server.http.identifications.models import (
    EXAMPLES,
    IdentificationAnswer,
    IdentificationListAnswer,
    IdentificationRequest,
)
from tauscope.server.http.openapi import binary_parts
from tauscope.server.http.tasks.queued import QueuedTask
from tauscope.server.http.tasks.router import HTML, JobDocument, text_document
from tauscope.server.queue.identification import IdentificationWorkspace

IDENTIFICATIONS = QueuedTask(
    noun="an identification",
    plural="identifications",
    kind=lambda services: services.identifications,
    workspace=IdentificationWorkspace,
    models=(IdentificationRequest, IdentificationAnswer, IdentificationListAnswer),
    examples=EXAMPLES,
    summary="Hand in an identification",
    words="The robot is checked at once, recordings are read by the job: follow `Location` until it has ended.",
    parts={
        "recordings": binary_parts("recordings that the model is made from"),
        "held_out": binary_parts("recordings that it is judged by"),
    },
    work_problems=("robot-file", "recording", "recording-mismatch", "identification", "invalid-request"),
    documents=(
        JobDocument(
            "result",
            "result.json",
            "Fetch the result",
            "The result of an identification that succeeded; else the problem that it ended in.",
            {"model": IdentificationDocument, "description": "the same document as `tauscope identify --json`"},
        ),
        JobDocument(
            "plots",
            "plots.json",
            "Fetch the data of its figures",
            "What figures of the identification are drawn from.",
            {
                "model": IdentificationPlots,
                "description": "torque over time and friction over velocity, joint by joint",
            },
        ),
        text_document(
            "report",
            "report.html",
            HTML,
            "Fetch the report",
            "The report as one page: no script, no request to anywhere, ready to print.",
            "page as `tauscope identify --report`",
        ),
    ),
    export_words="The identified model for a controller (json, yaml, c, python) or a simulator (urdf, mjcf).",
)

router = IDENTIFICATIONS.router()
