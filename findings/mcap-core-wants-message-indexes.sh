#!/bin/sh
# One would expect a chunk without message indexes, which the specification makes optional, to be read as a whole: the chunk index is there.
# McapIndexedReader of @mcap/core refuses the file at its beginning. mcap for Python, which wrote it by its own option, reads all five.
# A recording without these indexes (16 bytes a message, 30 % where messages are small) is lost to its users: Foxglove's reader opens none of it.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv env
env/bin/pip install --quiet --disable-pip-version-check mcap==1.6.0
npm install --silent --no-audit --no-fund @mcap/core@2.2.2 @mcap/nodejs@1.0.2 >/dev/null
cat >write.py <<'PY'
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer

with open("chunks.mcap", "wb") as file:
    writer = Writer(file, index_types=IndexType.CHUNK)
    writer.start("", "finding")
    channel = writer.register_channel("/ping", "json", 0)
    for t in range(5):
        writer.add_message(channel, log_time=t + 1, publish_time=t + 1, data=b"{}")
    writer.finish()
with open("chunks.mcap", "rb") as file:
    print(sum(1 for _ in make_reader(file).iter_messages()))
PY
cat >read.mjs <<'JS'
import { open } from "fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
const readable = new FileHandleReadable(await open("chunks.mcap", "r"));
try {
  const reader = await McapIndexedReader.Initialize({ readable });
  let count = 0;
  for await (const _ of reader.readMessages()) count++;
  console.log(count);
} catch (error) {
  console.log(error.message);
}
JS
python=$(env/bin/python write.py)
indexed=$(node read.mjs)
echo "mcap 1.6.0: $python messages; @mcap/core 2.2.2, indexed: $indexed"
[ "$python, $indexed" = "5, Encountered a chunk index without message indexes and non-zero start and end times" ] || { echo "this has changed"; exit 1; }
