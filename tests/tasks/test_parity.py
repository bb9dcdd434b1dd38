"""Every option of a verb is in its task's request, on the command line and in the REST API: same name, same default."""

from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from pydantic import BaseModel
from typer import Context
from typer.core import TyperGroup
from typer.main import get_command

from tauscope.cli.program import app
from tauscope.runtime.options import RunOptions
from tauscope.server.http.analyses import DIAGNOSES, IDENTIFICATIONS, DiagnosisRequest, IdentificationRequest
from tauscope.server.http.campaigns import CampaignRequest
from tauscope.server.http.excitations import ExcitationRequest
from tauscope.server.http.runs import RunRequest
from tauscope.server.http.settings import Settings
from tauscope.server.http.tasks.submission import BackendRequest
from tauscope.tasks import campaign, design_excitation, diagnose, identify, run
from tauscope.tasks.task import Outputs

FILES = {"robot", "recordings", "held_out", "simulated", "model"}
"""Fields of a request that name files: arguments, options or parts of a form."""

VERBS: Mapping[str, tuple[tuple[type[BaseModel], ...], tuple[type[BaseModel], ...]]] = {
    "identify": ((identify.IdentificationOptions,), (IdentificationRequest, identify.IdentificationOptions)),
    "diagnose": ((diagnose.DiagnosisOptions,), (DiagnosisRequest, diagnose.DiagnosisOptions)),
    "excite": (
        (design_excitation.ExcitationDesignOptions,),
        (ExcitationRequest, design_excitation.ExcitationDesignOptions),
    ),
    "run": ((RunOptions, run.BackendChoice, run.Request), (RunRequest, BackendRequest)),
    "campaign": ((campaign.Request,), (CampaignRequest,)),
}
"""Models that hold a verb's options: of the task, and of the REST API."""

NESTED = {"options", "backend"}
"""Fields whose own fields are options, except in a campaign, where each step is one option."""

RENAMED = {("run", "name"): "backend"}
"""A field whose option is called otherwise: the field `name` of the field `backend`."""

OUTPUTS = {
    "identify": {"json": "result", "report": "report", "export": "exports"},
    "diagnose": {
        "json": "result",
        "report": "report",
        "export": "exports",
        "model": "model",
        "scenario": "scenario",
        "improved_robot": "improved-robot",
        "next_trajectory": "next-trajectory",
    },
    "excite": {"json": "result", "csv": "trajectory", "rate": "trajectory"},
    "run": {"out": "recording"},
    "campaign": {"out": "result"},
}
"""Options of the command line that name a file to write, or how: REST serves these at a route of this name."""

TERMINAL = {
    "excite": {"slow_reversals"},  # another word for --slow-postures 0
    "run": {"dry_run"},  # shows what a bus would carry
}
"""Options that only a terminal has."""

OPERATOR = {("run", "name"): "backend", ("run", "time"): "sim_time"}
"""Fields that REST leaves null, because the service's settings say them."""


def fields(verb: str, models: tuple[type[BaseModel], ...]) -> dict[str, Any]:
    """Defaults by name of the options."""
    nested = set() if verb == "campaign" else NESTED
    return {
        name: info.get_default(call_default_factory=True)
        for model in models
        for name, info in model.model_fields.items()
        if name not in (FILES if verb != "campaign" else {"robot"}) | nested
    }


def options(verb: str) -> dict[str, Any]:
    """Options of the command line by each of their names."""
    program = get_command(app)
    assert isinstance(program, TyperGroup)
    command = program.get_command(Context(program), verb)
    assert command is not None
    return {
        name.removeprefix("--").replace("-", "_"): parameter
        for parameter in command.params
        for name in parameter.opts
        if name.startswith("--")
    }


def plain(value: Any) -> Any:
    """A default as plain data, however it is written."""
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, tuple) and all(isinstance(each, float) for each in value):
        return ",".join(f"{each:g}" for each in value) or None
    return value


def stated(verb: str, option: Any) -> Any:
    """A default of the command line, as the field of that name says it."""
    value: Any = option.default() if callable(option.default) else option.default
    if verb == "campaign":
        return {"none": None, "sim": {"name": "sim"}, "{}": {}}[value]
    if isinstance(value, list | tuple):
        return value[0] if len(value) == 1 else value or None
    return value


def pairs() -> Iterator[tuple[str, str]]:
    """Every verb with every option of its task."""
    for verb, (task, _) in VERBS.items():
        for name in fields(verb, task):
            yield verb, name


@pytest.mark.parametrize(("verb", "name"), list(pairs()))
def test_an_option_of_a_task_is_on_the_command_line_and_in_rest(verb: str, name: str) -> None:
    task, rest = (fields(verb, models) for models in VERBS[verb])
    option = options(verb).get(RENAMED.get((verb, name), name))
    assert option is not None, f"tauscope {verb} has no --{name.replace('_', '-')}"
    assert name in rest, f"the request of {verb} has no {name}"
    if (verb, name) in OPERATOR:
        assert rest[name] is None
        assert Settings.model_fields[OPERATOR[verb, name]].default == task[name]
    elif verb != "campaign":
        assert plain(rest[name]) == plain(task[name])
    if name in OUTPUTS[verb]:  # there, such a field is a file to write
        return
    found = stated(verb, option)
    if verb == "campaign" and found is not None:
        found = type(task[name]).model_validate(found)
    assert plain(task[name]) == plain(found)


@pytest.mark.parametrize("verb", VERBS)
def test_an_option_of_the_command_line_belongs_to_the_task_or_is_an_output(verb: str) -> None:
    known = {RENAMED.get((verb, name), name) for name in fields(verb, VERBS[verb][0])} | FILES | {"help"}
    known |= {*OUTPUTS[verb], *TERMINAL.get(verb, ())}
    for parameter in {id(each): each for each in options(verb).values()}.values():
        names = {name.removeprefix("--").replace("-", "_") for name in parameter.opts}
        assert names & known, f"tauscope {verb} {parameter.opts[0]} is unknown to its task"


@pytest.mark.parametrize("verb", VERBS)
def test_a_field_of_rest_belongs_to_the_task(verb: str) -> None:
    known = {*fields(verb, VERBS[verb][0])}
    known |= {"excitation"} if verb == "run" else set()  # an excitation that is kept, in place of a file
    assert set(fields(verb, VERBS[verb][1])) <= known


@pytest.mark.parametrize(("verb", "task"), [("identify", IDENTIFICATIONS), ("diagnose", DIAGNOSES)])
def test_an_output_of_the_command_line_has_a_route(verb: str, task: Any) -> None:
    routes = {document.name for document in task.documents} | {"exports"}
    assert set(OUTPUTS[verb].values()) <= routes


def test_an_output_is_made_when_it_is_asked_for_and_once() -> None:
    made: list[str] = []
    outputs = Outputs({"a": lambda: made.append("a") or "text", "b": lambda: made.append("b") or "text"})
    assert "a" in outputs
    assert "c" not in outputs
    assert made == []
    assert outputs["a"] == b"text"
    assert made == ["a"]
