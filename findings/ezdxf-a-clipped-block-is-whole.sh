#!/bin/sh
# One would expect what is outside of a block's clipping path (XCLIP) to be absent wherever ezdxf takes a block reference apart.
# Its drawing add-on cuts; `virtual_entities`, `disassemble.recursive_decompose` and `bbox.extents` give the whole block, and say nothing.
# It hurts importers of plans: a storey that an architect has clipped out of a site comes in with the site around it,
# and its extents are the site's.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ezdxf==1.4.5 pillow==12.0.0
cat >"$folder/clip.py" <<'PY'
import ezdxf
from ezdxf import bbox
from ezdxf.addons.drawing import Frontend, RenderContext
from ezdxf.addons.drawing.json import CustomJSONBackend
from ezdxf.disassemble import recursive_decompose
from ezdxf.xclip import XClip

doc = ezdxf.new("R2018")
block = doc.blocks.new("SITE")
block.add_line((1, 1), (2, 1))
block.add_line((50, 50), (51, 50))
reference = doc.modelspace().add_blockref("SITE", (0, 0))
XClip(reference).set_block_clipping_path([(0, 0), (10, 10)])
backend = CustomJSONBackend()
Frontend(RenderContext(doc), backend).draw_layout(doc.modelspace())
drawn = [line for each in backend.get_json_data() if each["type"] == "lines" for line in each["geometry"]]
apart = list(recursive_decompose(doc.modelspace()))
print(len(drawn), len(list(reference.virtual_entities())), len(apart), bbox.extents(doc.modelspace()).extmax.x)
PY
found=$("$folder/env/bin/python" "$folder/clip.py")
echo "ezdxf 1.4.5: lines drawn, virtual entities, decomposed, extent in x: $found"
[ "$found" = "1 2 2 51.0" ] || { echo "this has changed"; exit 1; }
