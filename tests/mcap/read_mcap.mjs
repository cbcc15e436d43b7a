// Reads what `viwo run --mcap` has written by libraries of others, and prints it as JSON for
// test_run_mcap.py: read_mcap.mjs FILE
import { readFileSync } from "node:fs";
import { McapIndexedReader } from "@mcap/core";
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";
import zstd from "@foxglove/wasm-zstd";

await zstd.isLoaded;
const bytes = readFileSync(process.argv[2]);
const reader = await McapIndexedReader.Initialize({
  readable: {
    size: async () => BigInt(bytes.length),
    read: async (at, n) => new Uint8Array(bytes.subarray(Number(at), Number(at + n))) },
  decompressHandlers: { zstd: (buffer, size) => zstd.decompress(buffer, Number(size)) } });
const readers = new Map();
const out = { topics: {}, in_order: true };
let last = 0n;
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  if (!readers.has(channel.id)) {
    const schema = reader.schemasById.get(channel.schemaId);
    const definitions = rosmsg.parse(new TextDecoder().decode(schema.data), { ros2: true });
    readers.set(channel.id, new serialization.MessageReader(definitions));
    out.topics[channel.topic] = {
      type: schema.name, encoding: schema.encoding, message_encoding: channel.messageEncoding, count: 0 };
  }
  if (message.logTime < last) out.in_order = false;
  last = message.logTime;
  const topic = out.topics[channel.topic];
  const content = readers.get(channel.id).readMessage(message.data);
  topic.first ??= content;
  topic.last = content;
  topic.count += 1;
}
// Typed arrays as lists.
console.log(JSON.stringify(out, (key, value) => ArrayBuffer.isView(value) ? Array.from(value) : value));
