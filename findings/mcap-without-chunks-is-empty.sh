#!/bin/sh
# One would expect every reader of MCAP to find the messages of a file without chunks, which the specification allows and the writer offers.
# The indexed reader of @mcap/core and Rerun's converter go by the chunk index: they give no message, and no error, though the statistics say five.
# It hurts whoever writes message by message so that a crash loses nothing: the recording opens, and is empty, in half of the programs.
# mcap 1.6.0 (Python) and the stream reader of @mcap/core read all five.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet --disable-pip-version-check mcap==1.6.0 rerun-sdk==0.41.0
npm install --silent --no-audit --no-fund @mcap/core@2.2.2 @mcap/nodejs@1.0.2 >/dev/null
cat >write.py <<'PY'
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

with open("flat.mcap", "wb") as file:
    writer = Writer(file, use_chunking=False, compression=CompressionType.NONE)
    writer.start("", "finding")
    schema = writer.register_schema("Ping", "jsonschema", b"{}")
    channel = writer.register_channel("/ping", "json", schema)
    for t in range(5):
        writer.add_message(channel, log_time=t, publish_time=t, data=b"{}")
    writer.finish()
with open("flat.mcap", "rb") as file:
    print(sum(1 for _ in make_reader(file).iter_messages()))
PY
cat >read.mjs <<'JS'
import { open } from "fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
const readable = new FileHandleReadable(await open("flat.mcap", "r"));
const reader = await McapIndexedReader.Initialize({ readable });
let count = 0;
for await (const _ of reader.readMessages()) count++;
console.log(`${count} of ${reader.statistics.messageCount}`);
JS
python=$(env/bin/python write.py)
indexed=$(node read.mjs)
env/bin/rerun mcap convert flat.mcap -o flat.rrd >/dev/null 2>&1
rows=$(env/bin/rerun rrd stats flat.rrd 2>/dev/null | sed -n 's/^num_rows_max = //p')
echo "mcap 1.6.0: $python messages; @mcap/core 2.2.2, indexed: $indexed; rerun-sdk 0.41.0: most rows of an entity: $rows"
[ "$python, $indexed, $rows" = "5, 0 of 5, 1" ] || { echo "this has changed"; exit 1; }
