"""The demo's second part: a campaign through the service, on an arm that conceals something, for the page to show."""

import shutil
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tauscope.cli.terminal import Told
from tauscope.diagnosis import DiagnosisDocument
from tauscope.errors import TauscopeError
from tauscope.robot import read_robot
from tauscope.runtime.options import RunOptions
from tauscope.server.control.campaign import CampaignOrder, CampaignWorkspace
from tauscope.server.http.campaigns import CAMPAIGNS, result_of
from tauscope.server.http.services import Services, open_services
from tauscope.server.http.settings import Settings
from tauscope.server.queue.job_folder import JobState
from tauscope.server.queue.task_job import stage_workspace
from tauscope.tasks.campaign import HeldOutMotion
from tauscope.tasks.design_excitation import ExcitationDesignOptions
from tauscope.tasks.diagnose import DiagnosisOptions
from tauscope.tasks.run import BackendChoice

ROOT = "/api/v1"
POLL_S = 0.2
RATE_HZ = 200.0
MOTION = ExcitationDesignOptions(starts=1, periods=2, slow_postures=1, closing_period=False)


def run_campaign(data: Path, robot_file: Path, scenario: Mapping[str, Any], told: Told) -> DiagnosisDocument:
    """Run a campaign on a simulated arm, and diagnose it. Raises TauscopeError if the campaign does not succeed."""
    with open_services(Settings(data_folder=data)) as services:
        identifier = _begin(services, robot_file, scenario)
        _wait_for_end(services, identifier, told)
        found = result_of(services, identifier, ROOT).diagnosis
    if found is None:
        raise TauscopeError("the demo's campaign made no diagnosis; run the demo again")
    return found


def _begin(services: Services, robot_file: Path, scenario: Mapping[str, Any]) -> str:
    with stage_workspace(services.campaigns.items, CampaignWorkspace) as workspace:
        shutil.copy(robot_file, workspace.robot)
        workspace.write_order(
            CampaignOrder(
                robot_file=robot_file.name,
                robot_name=read_robot(robot_file).name,
                backend=BackendChoice(name="sim", time="virtual", scenario=dict(scenario)),
                excitation=MOTION,
                held_out=HeldOutMotion(periods=1),
                run=RunOptions(rate_hz=RATE_HZ, feed_forward=False),
                diagnosis=DiagnosisOptions(),
            )
        )
        return services.campaigns.submit(workspace.folder)


def _wait_for_end(services: Services, identifier: str, told: Told) -> None:
    """Wait as long as it takes: the arm's time is virtual."""
    while True:
        answer = CAMPAIGNS.describe(services, identifier, ROOT)
        if answer.state == "damaged" or JobState(answer.state).is_end:
            break
        going = [step.name for step in answer.steps if step.state not in ("waiting", "succeeded", "finished")]
        told(f"concealed effect: {going[0] if going else 'begin'}", None)
        time.sleep(POLL_S)
    if answer.problem is not None:
        raise TauscopeError(f"the demo's campaign did not succeed: {answer.problem.detail}")
