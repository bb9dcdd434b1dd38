"""Leases on a clock that the test turns: one holder, stale tokens, expiry, arming, and what that means for motion."""

import threading

import pytest

from tauscope.server.control.leases import (
    BusyError,
    DeviceClaims,
    Lease,
    LeasedError,
    LeaseLostError,
    LeaseNeededError,
    Leases,
    NotArmedError,
)

ARM, OTHER = "arm on sim", "other on sim"


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def claims() -> DeviceClaims:
    return DeviceClaims(2)


@pytest.fixture
def ended() -> list[tuple[int, str]]:
    return []


@pytest.fixture
def leases(clock: Clock, claims: DeviceClaims, ended: list[tuple[int, str]]) -> Leases:
    def note(lease: Lease, why: str) -> None:
        ended.append((lease.number, why))

    return Leases(claims, clock=clock, on_end=note)


def test_one_holder_at_a_time(leases: Leases) -> None:
    lease = leases.acquire(ARM, "Ann", "a", 10.0)
    with pytest.raises(LeasedError, match=r"Ann has its lease, for 10\.0 s more"):
        leases.acquire(ARM, "Bob", "b", 10.0)
    assert leases.acquire(OTHER, "Bob", "b", 10.0).number == lease.number + 1
    assert [each.device for each in leases.active()] == [OTHER, ARM]


def test_it_lasts_as_long_as_there_are_signs_of_life_and_no_longer(
    leases: Leases, clock: Clock, ended: list[tuple[int, str]]
) -> None:
    lease = leases.acquire(ARM, "Ann", "a", 10.0)
    for _ in range(5):
        clock.now += 9.999
        assert leases.renew(ARM, lease.token, "a") is lease
    clock.now += 10.0
    assert leases.find_end_reason(lease) == "no sign of life for 10 s"
    assert ended == [(lease.number, "no sign of life for 10 s")]
    with pytest.raises(LeaseLostError, match="nobody has it"):
        leases.renew(ARM, lease.token, "a")
    clock.now -= 10.0  # nothing brings it back
    assert leases.find(lease.id) is None
    assert leases.acquire(ARM, "Bob", "b", 10.0).number > lease.number


def test_a_stale_token_changes_nothing_for_the_present_holder(leases: Leases, clock: Clock) -> None:
    stale = leases.acquire(ARM, "Ann", "a", 10.0)
    clock.now += 10.0
    present = leases.acquire(ARM, "Ann", "a", 10.0)
    leases.arm(ARM, present.token, "a", armed=True)
    for use in (
        lambda: leases.renew(ARM, stale.token, "a"),
        lambda: leases.arm(ARM, stale.token, "a", armed=False),
        lambda: leases.release(ARM, stale.token, "a"),
        lambda: leases.permit(ARM, stale.token, "a", is_needed=True),
    ):
        with pytest.raises(LeaseLostError):
            use()
    assert leases.active() == [present]
    assert present.is_armed


@pytest.mark.parametrize("token", ["", "1", "1-", "-", "x", "é", "\ud800", "2-{secret}", "{secret}"])
def test_a_token_is_right_as_a_whole_only(token: str, leases: Leases) -> None:
    lease = leases.acquire(ARM, "Ann", "a", 10.0)
    assert lease.token == f"1-{lease.secret}"
    with pytest.raises(LeaseLostError):
        leases.require(ARM, token.format(secret=lease.secret), "a")
    with pytest.raises(LeaseLostError):
        leases.require(ARM, lease.token, "b")
    assert leases.require(ARM, lease.token, "a") is lease


def test_a_token_of_before_a_restart_is_worth_nothing(claims: DeviceClaims) -> None:
    """The number may be the same again; the secret is not."""
    before, after = Leases(claims), Leases(claims)
    stale = before.acquire(ARM, "Ann", "a", 10.0)
    present = after.acquire(ARM, "Ann", "a", 10.0)
    assert stale.number == present.number
    with pytest.raises(LeaseLostError):
        after.require(ARM, stale.token, "a")


def test_an_arm_is_taken_by_whoever_may(leases: Leases, ended: list[tuple[int, str]]) -> None:
    lease = leases.acquire(ARM, "Ann", "a", 10.0)
    leases.arm(ARM, lease.token, "a", armed=True)
    permit = leases.permit(ARM, lease.token, "a", is_needed=True)
    assert permit.find_end_reason() is None
    taken = leases.acquire(ARM, "Eve", "e", 10.0, take=True)
    assert permit.find_end_reason() == "lease 1 of Ann ended: Eve took the arm"
    assert ended == [(1, "Eve took the arm")]
    assert not taken.is_armed


def test_nobody_leases_an_arm_that_moves_for_somebody_else(leases: Leases, claims: DeviceClaims) -> None:
    permit = leases.permit(ARM, None, "a", is_needed=False)
    claims.take(ARM, "run 1")
    permit.require()
    with pytest.raises(BusyError, match="run 1 has it"):
        leases.acquire(ARM, "Bob", "b", 10.0)
    assert leases.active() == []
    claims.release(ARM, "run 1")
    leases.acquire(ARM, "Bob", "b", 10.0)
    with pytest.raises(LeasedError):
        permit.require()
    with pytest.raises(LeasedError):
        leases.permit(ARM, None, "b", is_needed=False)


def test_motion_by_a_lease_wants_it_armed_and_ends_with_it(leases: Leases, clock: Clock) -> None:
    with pytest.raises(LeaseNeededError, match="Lease-Token"):
        leases.permit(ARM, None, "a", is_needed=True)
    lease = leases.acquire(ARM, "Ann", "a", 10.0)
    with pytest.raises(NotArmedError, match="/arm first"):
        leases.permit(ARM, lease.token, "a", is_needed=False)
    leases.arm(ARM, lease.token, "a", armed=True)
    permit = leases.permit(ARM, lease.token, "a", is_needed=True)
    assert permit.find_end_reason() is None
    permit.disarm()
    assert permit.find_end_reason() == "lease 1 of Ann was disarmed"
    with pytest.raises(NotArmedError):
        permit.require()
    leases.arm(ARM, lease.token, "a", armed=True)
    permit.require()
    clock.now += 10.0
    assert permit.find_end_reason() == "lease 1 of Ann ended: no sign of life for 10 s"
    with pytest.raises(LeaseLostError):
        permit.require()


def test_a_stop_of_everything_disarms_everything(leases: Leases) -> None:
    permits = []
    for device in (ARM, OTHER):
        lease = leases.acquire(device, "Ann", "a", 10.0)
        leases.arm(device, lease.token, "a", armed=True)
        permits.append(leases.permit(device, lease.token, "a", is_needed=True))
    leases.disarm_all()
    assert all(permit.find_end_reason() is not None for permit in permits)
    assert len(leases.active()) == 2


def test_of_fifty_that_want_an_arm_at_once_one_gets_it(leases: Leases) -> None:
    begin, won, lost = threading.Barrier(50), [], []

    def want(number: int) -> None:
        begin.wait()
        try:
            won.append(leases.acquire(ARM, str(number), str(number), 10.0))
        except LeasedError:
            lost.append(number)

    threads = [threading.Thread(target=want, args=(number,)) for number in range(50)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(won), len(lost)) == (1, 49)


def test_a_lease_and_a_motion_without_one_never_both_win() -> None:
    """Whoever moves claims first and looks at the leases then, whoever leases does it the other way round."""
    both = 0
    for _ in range(300):
        claims = DeviceClaims(1)
        leases = Leases(claims)
        permit, begin, winners = leases.permit(ARM, None, "a", is_needed=False), threading.Barrier(2), []

        def move(claims=claims, permit=permit, begin=begin, winners=winners) -> None:
            begin.wait()
            claims.take(ARM, "run 1")
            try:
                permit.require()
                winners.append("run")
            except LeasedError:
                claims.release(ARM, "run 1")

        thread = threading.Thread(target=move)
        thread.start()
        begin.wait()
        try:
            leases.acquire(ARM, "Bob", "b", 10.0)
            winners.append("lease")
        except BusyError:
            pass
        thread.join()
        both += len(winners) == 2
    assert both == 0
