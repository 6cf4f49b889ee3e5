# SPDX-License-Identifier: MIT
"""host/docs/recordings.md: its table of derived messages, from their schemas.

In: `echostep_app.output`. Out: the page with its table regenerated. Owns nothing.
"""

from __future__ import annotations

import json

from docs.pages import DOCS, between_marks
from echostep_app.output.derived import TOPICS
from echostep_app.output.foxglove import FRAME, LOCATION, LOG, POSE, SCENE
from echostep_app.recording.recorder import Topic

SHOWN_BY = {
    POSE.name: "where the trunk is; 3D panel",
    FRAME.name: "the same as a frame that the 3D panel can follow",
    SCENE.name: "plan (once), track, 95 % ellipse, both echoes as beams; 3D panel",
    LOCATION.name: "the place on Earth with its covariance, when the plan is georeferenced; map panel",
    LOG.name: "why the run's output could not be written any more; log panel",
}


def page() -> str:
    """The page with its table of derived messages regenerated."""
    rows = [
        f"| `{t.name}` | `{t.schema_name}` | {SHOWN_BY.get(t.name) or _fields(t)} |\n"
        for t in (*TOPICS, POSE, FRAME, SCENE, LOCATION, LOG)
    ]
    table = "| topic | schema | |\n|---|---|---|\n" + "".join(rows)
    return between_marks((DOCS / "recordings.md").read_text(), table)


def _fields(topic: Topic) -> str:
    return ", ".join(f"`{name}`" for name in json.loads(topic.schema)["properties"])
