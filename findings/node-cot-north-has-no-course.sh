#!/bin/sh
# One would expect @tak-ps/node-cot to turn an event into GeoJSON and back with the course, the speed and the accuracy that it had.
# A course of 0, due north, is lost on the way back, as a number that is not true; and the speed is taken over only if there is a course.
# The accuracies ce and le come back as 9999999, which stands for unknown. Nothing is raised.
# It hurts the maps built on it, as CloudTAK: a track due north has no heading, and a track without a compass no speed.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --ignore-scripts @tak-ps/node-cot@14.23.2 >/dev/null
cat >north.mjs <<'JS'
import { CoTParser as Cot } from "@tak-ps/node-cot";
const at = "2026-11-30T05:00:00Z";
const event = (track) => Cot.from_xml(`<event version="2.0" uid="a" type="a-f-G-U-C" how="m-g" time="${at}" start="${at}" stale="${at}">
  <point lat="48.0" lon="11.0" hae="500.0" ce="1.5" le="2.5"/><detail><track ${track}/></detail></event>`);
const motion = ({ properties: { course, speed } }) => `${course} ${speed}`;
const north = event('course="0.0" speed="1.25"');
const back = Cot.to_xml(await Cot.from_geojson(await Cot.to_geojson(north)));
console.log([
  back.match(/<track.*?>/)[0] + back.match(/ ce="\d+"/)[0],
  motion(await Cot.to_geojson(event('speed="1.25"'))),
].join("; "));
JS
seen=$(node north.mjs)
echo "node-cot 14.23.2, north at 1.25 m/s and back; GeoJSON's course and speed of a speed alone: $seen"
[ "$seen" = '<track speed="1.25"/> ce="9999999"; undefined undefined' ] || { echo "this has changed"; exit 1; }
