# SPDX-License-Identifier: MIT
"""Situations that public reports of neighbouring projects describe, each with the tests that hold its right result.

The names are those of the folders of the data set `small/situations`, whose EXPECTED.md states command, fault and right result of each.
"""

from __future__ import annotations

import re

import pytest

from board_runs import ROOT
from echostep_studies.frame.recordings import DATA
from needs_data import needs_data

TESTS = {
    "speech": ["page/elements/test_page_alarm.py::test_a_page_that_was_not_tapped_says_that_it_cannot_speak"],
    "numba": [
        "project/test_kernel_cache.py::test_without_a_home_kernels_go_to_a_temporary_folder_that_is_told_once",
        "project/test_service.py::test_it_runs_without_a_home_in_a_narrow_terminal_of_locale_c",
        "project/test_service.py::test_it_records_as_another_user_on_a_read_only_system",
    ],
    "acl": [
        "team/test_delivery.py::test_a_refused_report_is_told_within_a_second_and_not_counted_as_sent",
        "team/test_delivery.py::test_what_the_rules_allow_is_acknowledged_and_other_topics_are_refused",
    ],
    "baro": [
        "barometer/test_first_readings.py::test_a_file_says_how_many_first_readings_were_left_out",
        "odometry/test_barometer_start.py::test_heights_begin_anew_behind_a_reset_value",
    ],
    "mti": [
        "xsens/test_xsens_setup.py::test_a_stream_without_a_usable_sample_is_not_the_wanted_one",
        "xsens/test_xsens_setup.py::test_a_deaf_device_that_sends_what_is_needed_is_used_and_asked_again_until_it_answers",
        "xsens/test_xsens_startup.py::test_live_stops_at_a_device_that_is_set_wrongly_and_does_not_listen",
        "team/test_lost_place.py::test_its_report_has_no_position_and_the_last_known_one_with_its_age",
        "commands/test_bridged_ports.py::test_a_wearer_who_stands_where_many_places_fit_is_named_in_none",
    ],
    "replug": [
        "session/test_port_roles.py::test_two_devices_that_exchanged_their_ports_are_exchanged_back",
        "ports/test_places_of_ports.py::test_a_device_under_a_new_name_is_found_by_its_number",
        "session/test_arrivals.py::test_a_port_that_fell_silent_is_named_with_its_time",
        "session/test_arrivals.py::test_what_was_worn_and_has_no_estimate_is_told",
    ],
    "dxf": [
        "plan/drawings/test_units_of_drawings.py::test_a_unit_that_is_wrong_is_refused_with_the_right_one",
        "plan/test_plan_import_summary.py::test_sizes_that_no_building_has_are_told",
        "plan/test_plan_import_summary.py::test_walls_with_gaps_are_not_called_closed",
    ],
    "proxy": [
        "page/web/test_page_server.py::test_a_page_behind_a_proxy_with_https_is_served",
        "page/web/test_page_server.py::test_a_page_that_a_proxy_hides_is_refused_and_the_reason_is_told_once",
    ],
    "foot_times": ["offline/test_bursts.py::test_a_file_with_bursts_is_used_whole_and_says_so"],
    "tcp": [
        "commands/test_bridged_ports.py::test_a_run_over_the_network_is_read_in_blocks_and_tracked",
        "ports/test_places_of_ports.py::test_bytes_over_tcp_come_in_blocks_and_a_closed_connection_is_made_again",
    ],
    "order": [
        "recording/test_edit.py::test_some_milliseconds_between_two_ports_are_no_fault",
        "recording/test_edit.py::test_a_repair_is_offered_for_what_it_mends_alone",
    ],
    "mesh": [
        "session/test_port_roles.py::test_two_uses_of_one_port_are_refused_at_once",
        "team/test_mesh.py::test_a_node_that_answers_late_is_connected_and_gets_the_report",
    ],
    "tls": [
        "team/test_pkcs12.py::test_a_server_that_wants_a_certificate_accepts_it",
        "team/test_pkcs12.py::test_what_cannot_be_opened_is_one_sentence",
        "team/test_faults.py::test_a_certificate_of_another_name_is_named_and_its_name_can_be_given",
    ],
    "flash": ["commissioning/test_flash.py::test_what_avrdude_says_is_passed_on"],
    "osm": [
        "plan/test_plan_importer_osm.py::test_rooms_without_a_level_are_told",
        "plan/test_plan_importer_osm.py::test_a_room_drawn_as_a_relation_has_its_name",
    ],
    "cobs": ["board/test_noisy_lines.py::test_only_what_is_touched_is_lost_and_it_is_counted"],
    "foot_units": [
        "offline/test_foot_units.py::test_spellings_are_read_alike",
        "offline/test_foot_units.py::test_other_units_are_asked_about_with_the_remedy",
    ],
}


@pytest.mark.parametrize("situation", TESTS)
def test_the_tests_of_a_situation_exist(situation: str) -> None:
    for test in TESTS[situation]:
        file, _, name = test.partition("::")
        assert f"\ndef {name}(" in (ROOT / "tests" / file).read_text(), test


@needs_data("small/situations")
def test_each_row_of_the_expected_results_has_its_tests() -> None:
    rows = re.findall(r"^\| (`.*?) \|", (DATA / "small/situations/EXPECTED.md").read_text(), flags=re.M)
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(TESTS)
