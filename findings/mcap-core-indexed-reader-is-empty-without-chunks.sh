#!/bin/sh
# One would expect the indexed reader of @mcap/core to deliver the messages of every valid file, or to say that it cannot: a file without chunks is valid.
# It delivers none and raises nothing, although its own statistics of the file count them; the stream reader of the same package reads them all.
# It hurts who records without chunks, so that a power failure costs one message only: viewers that stand on this reader show an empty recording.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund @mcap/core@2.2.2 >/dev/null
cat >read.mjs <<'JS'
import { McapIndexedReader, McapStreamReader, McapWriter, TempBuffer } from '@mcap/core';
const file = new TempBuffer();
const writer = new McapWriter({ writable: file, useChunks: false });
await writer.start({ profile: '', library: '' });
const channelId = await writer.registerChannel({ topic: '/a', schemaId: 0, messageEncoding: 'x', metadata: new Map() });
for (let k = 0; k < 5; k++) {
  await writer.addMessage({ channelId, sequence: k, logTime: BigInt(k), publishTime: BigInt(k), data: new Uint8Array(4) });
}
await writer.end();
const reader = await McapIndexedReader.Initialize({ readable: file });
let indexed = 0;
for await (const _ of reader.readMessages()) indexed++;
const stream = new McapStreamReader();
stream.append(file.get());
let streamed = 0;
for (let record; (record = stream.nextRecord()); ) streamed += record.type === 'Message';
console.log(`indexed ${indexed}, by its statistics ${reader.statistics.messageCount}, streamed ${streamed}`);
JS
seen=$(node read.mjs)
echo "@mcap/core 2.2.2, five messages without chunks: $seen"
[ "$seen" = "indexed 0, by its statistics 5, streamed 5" ] || { echo "this has changed"; exit 1; }
