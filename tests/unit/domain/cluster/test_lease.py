"""What a gateway may do by what it knows of the lease of its site."""

from __future__ import annotations

import pytest

from app.domain.cluster.lease import LEASE_TTL_S, Leaseholder, LeaseState, SiteClaim, SiteTakenError, SiteUndecidedError

OTHER = Leaseholder(gateway="gw-2", address="elsewhere")


def test_a_lease_is_held_for_its_time_to_live_from_before_it_was_written() -> None:
    claim = SiteClaim.held(sent_s=100.0)
    assert claim.at(100.0 + LEASE_TTL_S - 0.01).state is LeaseState.HELD
    assert claim.at(100.0 + LEASE_TTL_S).state is LeaseState.UNDECIDED


@pytest.mark.parametrize("claim", [SiteClaim(LeaseState.ALONE), SiteClaim.held(sent_s=0.0)])
def test_a_gateway_alone_works_as_without_a_cluster(claim: SiteClaim) -> None:
    assert claim.why_no_new_work("north") is None
    assert claim.may_relay("gw-1")


def test_nothing_new_begins_while_another_gateway_has_the_site_or_that_is_not_known() -> None:
    taken = SiteClaim.taken(OTHER).why_no_new_work("north")
    assert isinstance(taken, SiteTakenError)
    assert (taken.detail, taken.extra) == ("another gateway (gw-2) has the site north", {"holder": "gw-2"})
    assert isinstance(SiteClaim().why_no_new_work("north"), SiteUndecidedError)


def test_that_another_gateway_has_the_site_stays_true_while_nobody_can_be_asked() -> None:
    assert SiteClaim.taken(OTHER).unanswered(1.0, has_standby=False) == SiteClaim.taken(OTHER)
    for claim in (SiteClaim.held(sent_s=0.0), SiteClaim()):
        alone = claim.unanswered(1.0, has_standby=False)
        assert alone.at(1e6).state is LeaseState.ALONE, "for as long as it takes"


def test_with_a_standby_being_alone_is_confirmed_all_the_time() -> None:
    alone = SiteClaim.held(sent_s=0.0).unanswered(1.0, has_standby=True)
    assert alone.at(1.0 + LEASE_TTL_S - 0.1).state is LeaseState.ALONE
    assert alone.at(1.0 + LEASE_TTL_S).state is LeaseState.UNDECIDED
    assert SiteClaim().unanswered(1.0, has_standby=True).state is LeaseState.UNDECIDED


def test_nothing_new_begins_while_the_gateway_whose_lease_expired_may_still_command() -> None:
    claim = SiteClaim.expired(OTHER)
    assert isinstance(claim.why_no_new_work("north"), SiteTakenError)
    assert claim.unanswered(1.0, has_standby=True) == claim


def test_of_two_copies_of_a_journal_only_the_holder_s_is_relayed() -> None:
    assert not SiteClaim.taken(Leaseholder(gateway="gw-1", address="elsewhere")).may_relay("gw-1")
    assert SiteClaim.taken(OTHER).may_relay("gw-1"), "another journal is no copy: its events are told"
    assert not SiteClaim().may_relay("gw-1")
