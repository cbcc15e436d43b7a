// Writes the .mcap files of this folder with libraries of others; README.md says how.
// The messages are those that write_drive() in test_fixture.hpp writes with SQLite.
import { mkdirSync, writeFileSync } from "node:fs";
import { McapWriter } from "@mcap/core";
import messages from "@foxglove/rosmsg-msgs-common";
import serialization from "@foxglove/rosmsg2-serialization";
import lz4 from "lz4js";
import zstd from "@foxglove/wasm-zstd";

const kStart = 1_700_000_000_123_456_789n;
const kMs = 1_000_000n;
const kSteps = 20;

/** A type with all that it uses. */
function definitions(type, known = []) {
  const all = messages.ros2humble;
  if (known.includes(all[type])) return known;
  known.push(all[type]);
  for (const field of all[type].definitions) if (field.isComplex) definitions(field.type, known);
  return known;
}

/** The fields of a type, then those of all that it uses, as ROS 2 has them in *.msg. */
function text(type) {
  const line = (field) => `${field.type}${field.isArray ? `[${field.arrayLength ?? ""}]` : ""} ${field.name}\n`;
  const fields = (one) => one.definitions.filter((f) => !f.isConstant).map(line).join("");
  const [first, ...others] = definitions(type);
  return others.reduce((sum, one) => sum + "=".repeat(80) + `\nMSG: ${one.name}\n` + fields(one), fields(first));
}

const header = (t, frame_id) => ({
  stamp: { sec: Number(t / 1_000_000_000n), nanosec: Number(t % 1_000_000_000n) }, frame_id });
const zeros = new Float64Array(9);
const vector = (x, y, z) => ({ x, y, z });
const quaternion = (x, y, z, w) => ({ x, y, z, w });

/** [topic, type, message] of one step. */
function* step(k) {
  const t = kStart + 5n * BigInt(k) * kMs;
  const x = 0.1 * k + 1 / 3;
  yield ["/imu0", "sensor_msgs/Imu", {
    header: header(t, "imu_link"), orientation: quaternion(0, 0, 0, 1), orientation_covariance: zeros,
    angular_velocity: vector(x, -x, 0.2), angular_velocity_covariance: zeros,
    linear_acceleration: vector(1, x, 9.81), linear_acceleration_covariance: zeros }];
  yield ["/joints", "sensor_msgs/JointState", {
    header: header(t, ""), name: ["steer", "drive"], position: Float64Array.of(x, 0),
    velocity: Float64Array.of(0, 3 + x), effort: new Float64Array(0) }];
  if (k % 4 !== 0) return;
  yield ["/cam0", "sensor_msgs/Image", {
    header: header(t, "camera"), height: 2, width: 3, encoding: "mono8", is_bigendian: 0, step: 3,
    data: new Uint8Array(6).fill(k) }];
  yield ["/pose", "geometry_msgs/PoseStamped", {
    header: header(t, "f"), pose: { position: vector(x, 1, 2), orientation: quaternion(0, 0, 0.6, 0.8) } }];
}

async function write(file, options, begin = 0, end = kSteps) {
  const parts = [];
  let size = 0n;
  const writable = {
    async write(bytes) { parts.push(Buffer.from(bytes)); size += BigInt(bytes.length); },
    position: () => size };
  const writer = new McapWriter({ writable, chunkSize: 2048, ...options });
  await writer.start({ profile: "ros2", library: "" });
  const channels = new Map();
  for (let k = begin; k < end; ++k) {
    const received = kStart + 5n * BigInt(k) * kMs + kMs;
    for (const [topic, type, message] of step(k)) {
      if (!channels.has(topic)) {
        const schemaId = await writer.registerSchema({
          name: type.replace("/", "/msg/"), encoding: "ros2msg", data: Buffer.from(text(type)) });
        const id = await writer.registerChannel({ schemaId, topic, messageEncoding: "cdr", metadata: new Map() });
        channels.set(topic, { id, writer: new serialization.MessageWriter(definitions(type)) });
      }
      const channel = channels.get(topic);
      await writer.addMessage({
        channelId: channel.id, sequence: k, logTime: received, publishTime: received,
        data: channel.writer.writeMessage(message) });
    }
  }
  await writer.end();
  writeFileSync(file, Buffer.concat(parts));
}

await zstd.isLoaded;
const compressed = (compression, compress) => ({
  compressChunk: (bytes) => ({ compression, compressedData: compress(bytes) }) });
const by_zstd = compressed("zstd", (bytes) => zstd.compress(bytes, 3));
const by_lz4 = compressed("lz4", (bytes) => lz4.compress(bytes));
const no_summary = {
  useStatistics: false, useSummaryOffsets: false, repeatSchemas: false, repeatChannels: false,
  useMessageIndex: false, useChunkIndex: false };

await write("plain.mcap", {});
await write("lz4.mcap", by_lz4);
await write("zstd.mcap", by_zstd);
await write("unchunked.mcap", { useChunks: false });
await write("no_summary.mcap", { ...by_zstd, ...no_summary });
mkdirSync("split", { recursive: true });
await write("split/split_0.mcap", by_zstd, 0, kSteps / 2);
await write("split/split_1.mcap", by_zstd, kSteps / 2);
writeFileSync("split/metadata.yaml", `rosbag2_bagfile_information:
  version: 5
  storage_identifier: mcap
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
    - split_0.mcap
    - split_1.mcap
`);
