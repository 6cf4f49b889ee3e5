#!/bin/sh
# One would expect a converter of CoT events to TAK's protobuf to keep its rule (detail.proto): an element with more than its message has room for
# goes as a whole into xmlDetail. takproto and node-cot write the message and drop the rest: phone, readiness, slope. Neither says so.
# node-cot drops `precisionlocation` altogether, which has a message of its own: it looks for the element's name, not for the field's.
# It hurts what receives the event behind a TAK server: that a position is computed, not measured, and the wearer's phone are known in XML alone.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet --disable-pip-version-check takproto==3.0.1
npm install --silent --no-audit --no-fund --ignore-scripts @tak-ps/node-cot@14.23.2 >/dev/null
cat >event.xml <<'XML'
<event version="2.0" uid="a" type="a-f-G-U-C" how="m-g" time="2026-11-30T05:00:00Z" start="2026-11-30T05:00:00Z" stale="2026-11-30T05:01:00Z">
<point lat="48.0" lon="11.0" hae="500.0" ce="1.5" le="2.5"/>
<detail><contact callsign="ANNA" phone="5550100"/><status battery="77" readiness="true"/><track course="90.0" speed="1.25" slope="3.0"/>
<precisionlocation geopointsrc="CALC"/></detail></event>
XML
cat >wire.py <<'PY'
from takproto import xml2proto

wire = bytes(xml2proto(open("event.xml").read()))
print(*(word for word in ("ANNA", "phone", "readiness", "slope", "CALC") if word.encode() in wire))
PY
cat >wire.mjs <<'JS'
import { readFileSync } from "fs";
import { CoTParser } from "@tak-ps/node-cot";
const wire = Buffer.from(await CoTParser.to_proto(await CoTParser.from_xml(readFileSync("event.xml", "utf8"))));
console.log(...["ANNA", "phone", "readiness", "slope", "CALC"].filter((word) => wire.includes(word)));
JS
python=$(env/bin/python wire.py)
node=$(node wire.mjs)
echo "of ANNA, phone, readiness, slope, CALC there remain by takproto 3.0.1: $python; by node-cot 14.23.2: $node"
[ "$python; $node" = "ANNA CALC; ANNA" ] || { echo "this has changed"; exit 1; }
