#!/bin/sh
# One would expect each reader of MCAP to find the messages of a file without what the specification makes optional: chunks, or message indexes.
# Without chunks the indexed reader of @mcap/core and Rerun's converter give no message, and no error, though the statistics say five.
# Without message indexes the former refuses the file. mcap 1.6.0, for Python, wrote both by its own options, and reads all five.
# It hurts recordings written message by message, so that a crash loses nothing, or to save 16 bytes a message: Foxglove's reader shows none of it.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet --disable-pip-version-check mcap==1.6.0 rerun-sdk==0.41.0
npm install --silent --no-audit --no-fund @mcap/core@2.2.2 @mcap/nodejs@1.0.2 >/dev/null
cat >write.py <<'PY'
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

for name, option in (("flat", {"use_chunking": False}), ("chunks", {"index_types": IndexType.CHUNK})):
    with open(f"{name}.mcap", "wb") as file:
        writer = Writer(file, compression=CompressionType.NONE, **option)
        writer.start("", "finding")
        schema = writer.register_schema("Ping", "jsonschema", b"{}")
        channel = writer.register_channel("/ping", "json", schema)
        for t in range(5):
            writer.add_message(channel, log_time=t + 1, publish_time=t + 1, data=b"{}")
        writer.finish()
    with open(f"{name}.mcap", "rb") as file:
        print(sum(1 for _ in make_reader(file).iter_messages()), end=" ")
PY
cat >read.mjs <<'JS'
import { open } from "fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
for (const name of ["flat", "chunks"]) {
  const readable = new FileHandleReadable(await open(`${name}.mcap`, "r"));
  try {
    const reader = await McapIndexedReader.Initialize({ readable });
    let count = 0;
    for await (const _ of reader.readMessages()) count++;
    console.log(`${count} of ${reader.statistics.messageCount};`);
  } catch (error) {
    console.log(error.message);
  }
}
JS
python=$(env/bin/python write.py)
indexed=$(node read.mjs | tr '\n' ' ')
env/bin/rerun mcap convert flat.mcap -o flat.rrd >/dev/null 2>&1
rows=$(env/bin/rerun rrd stats flat.rrd 2>/dev/null | sed -n 's/^num_rows_max = //p')
echo "without chunks; without message indexes: mcap 1.6.0: $python; @mcap/core 2.2.2: $indexed; rerun-sdk 0.41.0: most rows of an entity: $rows"
refused="Encountered a chunk index without message indexes and non-zero start and end times"
[ "$python$indexed$rows" = "5 5 0 of 5; $refused 1" ] || { echo "this has changed"; exit 1; }
