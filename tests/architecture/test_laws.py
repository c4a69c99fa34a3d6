"""Each law of the design over all files. A failure names file and line."""

from __future__ import annotations

from tests.architecture import autopilots, events, imports, items, ownership, shape
from tests.architecture.sources import ROOT, files, python_sources
from tests.support.violations import held
from tools import architecture

BUILD_FILES = ("Makefile", "Dockerfile", "compose.yaml", ".ci/run", "pyproject.toml")
SCHEMA = "web/src/api/schema.d.ts"
"""Generated from the API."""
PAGE_FILES = ("web/.npmrc", "web/package-lock.json")
LOCK_FILES = ("requirements.txt", "requirements-build.txt", "requirements-cluster.txt", "requirements-dev.txt")

APP = python_sources("app")
ALL = python_sources("app", "tests", "bench", "scripts", "tools")


def texts(paths: tuple[str, ...]) -> dict[str, str]:
    return {path: (ROOT / path).read_text(encoding="utf-8") for path in paths}


def test_there_are_files_to_check() -> None:
    assert len(APP) > 10


def test_imports_go_one_way() -> None:
    held(imports.wrong_directions(APP))


def test_no_modules_import_each_other() -> None:
    held(imports.import_cycles((*APP, *python_sources("tools"))))


def test_the_packages_of_the_domain_follow_each_other() -> None:
    held(imports.package_cycles(architecture.import_graph(architecture.modules(ROOT))))


def test_no_test_imports_a_test() -> None:
    held(imports.tests_imported(python_sources("tests", "bench")))


def test_a_unit_test_lies_in_the_folder_of_what_it_tests() -> None:
    held(imports.tests_outside_packages(python_sources("tests"), python_sources("app", "tools")))


def test_every_file_of_app_is_in_a_layer_of_the_design() -> None:
    held(imports.unknown_layers(APP))


def test_a_library_is_known_to_its_one_layer_alone() -> None:
    held(imports.shared_exclusives(APP))


def test_only_api_serves_http() -> None:
    held(imports.servers_outside_api(APP))


def test_reasons_become_sentences_only_where_people_read_them() -> None:
    held(imports.words_inside(APP))


def test_who_handles_events_names_each_kind() -> None:
    held(events.wildcards(APP))


def test_domain_and_interchange_are_pure() -> None:
    held(imports.impure_parts(APP))


def test_what_only_one_autopilot_knows_stands_in_its_folder() -> None:
    held(autopilots.named_outside(APP))


def test_nobody_goes_through_the_item_types_one_by_one() -> None:
    held(items.ladders(APP))


def test_a_new_item_touches_at_most_eight_files_as_photo_did() -> None:
    written = [path for suffix in (".py", ".xml", ".ts", ".tsx", ".css") for path in files(suffix, "app", "web/src")]
    shipped = tuple(path for path in written if "/testing/" not in path and ".test." not in path and path != SCHEMA)
    assert items.touched_by_photo(texts(shipped)) == items.TOUCHED_BY_PHOTO
    assert len(items.TOUCHED_BY_PHOTO) <= 8


def test_who_asks_an_autopilot_asks_the_interface() -> None:
    held(autopilots.folders_imported(APP))


def test_nobody_writes_another_object_s_attributes() -> None:
    held(ownership.foreign_writes(APP))


def test_no_test_reaches_into_a_private_attribute() -> None:
    held(ownership.private_uses(python_sources("tests"), ownership.private_names(APP)))


def test_files_have_at_most_500_lines() -> None:
    page = tuple(path for suffix in (".ts", ".tsx", ".css") for path in files(suffix, "web/src"))
    hand_written = tuple(path for path in page if not path.endswith("schema.d.ts"))
    held(shape.long_files({source.path: source.text for source in ALL} | texts(hand_written)))


def test_functions_have_less_than_50_lines() -> None:
    held(shape.long_functions(ALL))


def test_constructors_take_at_most_eight_things() -> None:
    held(shape.wide_constructors(APP))


def test_a_class_name_means_one_thing_in_a_layer() -> None:
    held(shape.double_class_names(APP))


def test_names_say_the_job() -> None:
    held(shape.vague_names(ALL))


def test_nothing_prints() -> None:
    held(shape.prints(APP))


def test_nothing_catches_everything() -> None:
    held(shape.blind_excepts(ALL))


def test_every_queue_is_bounded() -> None:
    held(shape.unbounded_queues(APP))


def test_no_path_of_one_machine() -> None:
    held(shape.fixed_paths(APP))


def test_build_and_lock_files_name_no_download_address() -> None:
    present = tuple(
        path for path in (*BUILD_FILES, *PAGE_FILES, *LOCK_FILES, *files(".sh", "scripts")) if (ROOT / path).is_file()
    )
    assert set(LOCK_FILES) <= set(present)
    held(shape.addresses(texts(present)))


def test_lock_files_pin_by_version_and_hash() -> None:
    held(shape.unpinned(texts(LOCK_FILES)))
