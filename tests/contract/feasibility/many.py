"""The agreement of rules and autopilot on many more plans than the suite has time for: `make agreement`.

Usage: python -m tests.contract.feasibility.many [--examples 10000] [--wire 100] [--seed N]

In process each example is a random plan for a vehicle with random parameters. Over the wire accepted plans are uploaded
through MAVSDK to simulated vehicles of every type, and each vehicle must say that it can fly them (mission_state).
"""

from __future__ import annotations

import argparse
import asyncio
import secrets
import sys
from collections import Counter, defaultdict
from collections.abc import Callable

from hypothesis import HealthCheck, Phase, given, seed, settings

from app.domain.errors import PlanRejectedError
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.rules import check_plan
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import VehicleType
from app.simulator.firmware import PX4_MAIN
from tests.contract.feasibility.autopilot import AIRFRAME_OF, facts_of, refusals
from tests.support.driving import opened, until, uploaded
from tests.support.plans_and_vehicles import Case, cases
from tests.support.simulated import SimulatedFleet


def each_case(visit: Callable[[Case], None], examples: int, number: int) -> None:
    """Call `visit` with so many cases; the same seed gives the same ones."""

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @seed(number)
    @given(cases())
    def visiting(case: Case) -> None:
        visit(case)

    visiting()


def in_process(examples: int, number: int) -> dict[VehicleType, list[Plan]]:
    """Judge each case by both. Prints the table; the plans accepted for a vehicle as it comes from the factory."""
    counts: Counter[tuple[str, str]] = Counter()
    accepted: dict[VehicleType, list[Plan]] = defaultdict(list)

    def visit(case: Case) -> None:
        kind = case.plan.vehicle_type
        facts = facts_of(kind, case.params, case.profile)
        taken = not any(finding.severity is Severity.ERROR for finding in check_plan(case.plan, facts))
        try:
            refused = refusals(compile_plan(case.plan, facts), kind, case.params, case.profile)
        except PlanRejectedError as error:
            refused = [error.detail]
        if taken and refused:
            raise AssertionError(f"accepted by Waydrop, refused by the autopilot: {refused} {case}")
        counts[kind.value, "both accept" if taken else "both reject" if refused else "Waydrop alone rejects"] += 1
        if taken and not case.params and case.profile is PX4_MAIN:
            accepted[kind].append(case.plan)

    each_case(visit, examples, number)
    for (kind, verdict), count in sorted(counts.items()):
        print(f"{kind:12} {verdict:22} {count:6}")
    return accepted


async def over_the_wire(accepted: dict[VehicleType, list[Plan]], count: int) -> int:
    """Upload accepted plans, and wait for each vehicle to say that it can fly its own. How many were uploaded."""
    kinds = list(AIRFRAME_OF)
    with SimulatedFleet(",".join(AIRFRAME_OF[kind] for kind in kinds), speed=4.0) as fleet:
        async with opened(fleet.connections, vehicles=len(kinds)) as source:
            links = {link.identity.vehicle_type: link for link in source.links()}
            done = 0
            for kind in kinds:
                link = links[kind]
                await until(lambda link=link: link.state().home is not None, "it must know its home", 30.0)
                facts = await link.read_facts()
                for plan in accepted[kind][: count // len(kinds)]:
                    if any(finding.severity is Severity.ERROR for finding in check_plan(plan, facts)):
                        continue  # the fleet stands elsewhere, or has other parameters
                    last = await uploaded(link, compile_plan(plan, facts))
                    await link.wait_mission_ready(mission_id=last.mission_id, rerun=False, timeout_s=10.0)
                    done += 1
    return done


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=10_000)
    parser.add_argument("--wire", type=int, default=100)
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31))
    options = parser.parse_args()
    print(f"seed {options.seed}, {options.examples} examples in process", flush=True)
    accepted = in_process(options.examples, options.seed)
    done = asyncio.run(over_the_wire(accepted, options.wire))
    print(f"over the wire: {done} accepted plans uploaded, each found feasible by its vehicle")
    if done == 0:
        sys.exit("none was uploaded: nothing was shown")


if __name__ == "__main__":
    main()
