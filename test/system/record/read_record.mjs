// Reads an MCAP file with readers of other projects, from its index and once more from its
// beginning. Decodes every message by the definition in the file, and prints the content as JSON:
//
//   npm install && node read_record.mjs FILE.mcap      (versions: package.json)
import assert from "node:assert";
import { open } from "node:fs/promises";
import * as mcap from "@mcap/core";
import rosmsg from "@foxglove/rosmsg";
import rosmsg2 from "@foxglove/rosmsg2-serialization";
import * as fzstd from "fzstd";

const file = await open(process.argv[2]);
const size = (await file.stat()).size;
const bytes = new Uint8Array(size);
await file.read(bytes, 0, size, 0);
const readable = {
  size: async () => BigInt(size),
  read: async (offset, length) => bytes.slice(Number(offset), Number(offset + length)),
};
const decompressHandlers = {
  zstd: (data, whole) => fzstd.decompress(data, new Uint8Array(Number(whole))),
};

const decoders = new Map();
function decode(channel, schema, data) {
  assert.equal(channel.messageEncoding, "cdr");
  assert.equal(schema.encoding, "ros2msg");
  if (!decoders.has(schema.name))
    decoders.set(schema.name, new rosmsg2.MessageReader(
      rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true })));
  return decoders.get(schema.name).readMessage(data);
}

// From the beginning, up to the end or an incomplete chunk.
const inOrder = [];
const schemas = new Map(), channels = new Map();
const stream = new mcap.McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(bytes);
for (let record; (record = stream.nextRecord()) !== undefined;) {
  if (record.type === "Schema") schemas.set(record.id, record);
  if (record.type === "Channel") channels.set(record.id, record);
  if (record.type === "Message") inOrder.push(record);
}
const read = { whole: stream.done(), topics: {}, last: {}, messages: inOrder.length };
for (const message of inOrder) {
  const channel = channels.get(message.channelId), schema = schemas.get(channel.schemaId);
  const value = decode(channel, schema, message.data);
  const topic = (read.topics[channel.topic] ??= { type: schema.name, count: 0 });
  ++topic.count;
  read.last[channel.topic] = value;
}

// By its index: the same messages, in order of time.
if (read.whole) {
  const reader = await mcap.McapIndexedReader.Initialize({ readable, decompressHandlers });
  const key = (message) =>
    `${message.logTime} ${message.channelId} ${message.sequence} ${message.data.length}`;
  const indexed = [];
  for await (const message of reader.readMessages()) indexed.push(message);
  for (let k = 1; k < indexed.length; ++k) assert(indexed[k - 1].logTime <= indexed[k].logTime);
  assert.deepStrictEqual(indexed.map(key).sort(), inOrder.map(key).sort());
  assert.equal(Number(reader.statistics.messageCount), inOrder.length);
  assert.equal(reader.chunkIndexes.length, reader.statistics.chunkCount);
}

await file.close();  // otherwise Node may print a warning beside the JSON
const path = Object.entries(read.last).find(([topic]) => topic.endsWith("/path"))?.[1];
console.log(JSON.stringify({
  whole: read.whole, messages: read.messages, topics: read.topics,
  path: path?.poses.map(({ header: { stamp }, pose: { position: p, orientation: q } }) =>
    [stamp.sec, stamp.nanosec, p.x, p.y, p.z, q.x, q.y, q.z, q.w]) ?? [],
}));
