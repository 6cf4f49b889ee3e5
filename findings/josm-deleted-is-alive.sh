#!/bin/sh
# One would expect an object that was deleted in JOSM, which saves it with action='delete' until it is uploaded, to be gone for a reader of the file.
# Three packages for OpenStreetMap's XML read it as alive, `visible` included: they know the attribute of the server's files, not of the editor's.
# It hurts whoever saves a plan from JOSM and imports it: a wall that was taken out of the building stands.
# The way -8, drawn anew, and the way 7, deleted, are told apart by none of them.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet --disable-pip-version-check osmium==4.3.2 osm2geojson==0.3.2 overpy==0.7
cat >plan.osm <<'XML'
<?xml version="1.0" encoding="UTF-8"?>
<osm version="0.6" generator="JOSM">
  <node id="-1" action="modify" visible="true" lat="48.0" lon="11.0"/>
  <node id="-2" action="modify" visible="true" lat="48.0" lon="11.001"/>
  <way id="7" action="delete" visible="true" version="1"><nd ref="-1"/><nd ref="-2"/><tag k="indoor" v="wall"/></way>
  <way id="-8" action="modify" visible="true"><nd ref="-1"/><nd ref="-2"/><tag k="indoor" v="door"/></way>
</osm>
XML
cat >read.py <<'PY'
import osm2geojson
import osmium
import overpy

alive = []


class Ways(osmium.SimpleHandler):
    def way(self, way):
        alive.append(way.id if way.visible and not way.deleted else None)


Ways().apply_file("plan.osm")
text = open("plan.osm").read()
features = osm2geojson.xml2geojson(text)["features"]
lines = [f["properties"]["id"] for f in features if f["properties"]["type"] == "way"]
print(alive, sorted(lines, reverse=True), sorted((way.id for way in overpy.Result.from_xml(text).ways), reverse=True))
PY
found=$(env/bin/python read.py)
echo "ways by osmium 4.3.2, osm2geojson 0.3.2, overpy 0.7: $found"
[ "$found" = "[7, -8] [7, -8] [7, -8]" ] || { echo "this has changed"; exit 1; }
