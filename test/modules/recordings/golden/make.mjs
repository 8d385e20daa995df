// Writes messages.txt: messages of ROS 2 as @foxglove/rosmsg2-serialization writes them, by the
// definitions of @foxglove/rosmsg-msgs-common, each read back by it and compared with what was
// written. The test has the same values: bytes of either are those of the other.
//
//   npm install && node make.mjs > messages.txt      (versions: package.json)
import assert from "node:assert";
import rosmsg2 from "@foxglove/rosmsg2-serialization";
import definitions from "@foxglove/rosmsg-msgs-common";

const { MessageReader, MessageWriter } = rosmsg2;

const known = definitions.ros2humble;

// A definition with those of all types in it, its own first.
function closure(type) {
  const found = new Map();
  const add = (name) => {
    if (found.has(name)) return;
    const definition = known[name];
    assert(definition, `no definition of ${name}`);
    found.set(name, definition);
    for (const field of definition.definitions) if (field.isComplex) add(field.type);
  };
  add(type);
  return [...found.values()];
}

let next = 0.5;
const doubles = (count) => Array.from({ length: count }, () => next++);
const vector = () => {
  const [x, y, z] = doubles(3);
  return { x, y, z };
};
const quaternion = () => {
  const [x, y, z, w] = doubles(4);
  return { x, y, z, w };
};
const pose = () => ({ position: vector(), orientation: quaternion() });
const header = (frame_id) => ({ stamp: { sec: 1700000001, nanosec: 123456789 }, frame_id });
const poseStamped = (frame) => ({ header: header(frame), pose: pose() });
const transform = (frame, child_frame_id) => ({
  header: header(frame),
  child_frame_id,
  transform: { translation: vector(), rotation: quaternion() },
});

const color = () => {
  const [r, g, b, a] = [0.25, 0.5, 0.75, 1];
  return { r, g, b, a };
};
const marker = (ns, count) => ({
  header: header("map"), ns, id: -2, type: 11, action: 0, pose: pose(), scale: vector(),
  color: color(), lifetime: { sec: 3, nanosec: 4 }, frame_locked: true,
  points: Array.from({ length: count }, vector), colors: Array.from({ length: count }, color),
  texture_resource: "",
  texture: { header: { stamp: { sec: 0, nanosec: 0 }, frame_id: "" }, format: "",
             data: new Uint8Array() },
  uv_coordinates: [], text: "faces", mesh_resource: "",
  mesh_file: { filename: "", data: new Uint8Array() }, mesh_use_embedded_materials: false,
});

const messages = [
  ["sensor_msgs/Image", () => ({
    header: header("left"), height: 2, width: 3, encoding: "mono8", is_bigendian: 0, step: 3,
    data: Uint8Array.from([1, 2, 3, 4, 5, 6]) })],
  ["sensor_msgs/Image", () => ({
    header: header(""), height: 0, width: 0, encoding: "", is_bigendian: 1, step: 0,
    data: new Uint8Array() })],
  ["sensor_msgs/CompressedImage", () => ({
    header: header("a"), format: "jpeg", data: Uint8Array.from([1, 2, 3]) })],
  ["sensor_msgs/Imu", () => ({
    header: header("imu0"), orientation: quaternion(), orientation_covariance: doubles(9),
    angular_velocity: vector(), angular_velocity_covariance: doubles(9),
    linear_acceleration: vector(), linear_acceleration_covariance: doubles(9) })],
  ["sensor_msgs/CameraInfo", () => ({
    header: header("left"), height: 480, width: 752, distortion_model: "plumb_bob",
    d: doubles(5), k: doubles(9), r: doubles(9), p: doubles(12), binning_x: 1, binning_y: 2,
    roi: { x_offset: 3, y_offset: 4, height: 5, width: 6, do_rectify: true } })],
  ["sensor_msgs/CameraInfo", () => ({
    header: header("le"), height: 1, width: 2, distortion_model: "", d: [], k: doubles(9),
    r: doubles(9), p: doubles(12), binning_x: 0, binning_y: 0,
    roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false } })],
  ["geometry_msgs/PoseStamped", () => poseStamped("map")],
  ["nav_msgs/Odometry", () => ({
    header: header("odom"), child_frame_id: "base_link",
    pose: { pose: pose(), covariance: doubles(36) },
    twist: { twist: { linear: vector(), angular: vector() }, covariance: doubles(36) } })],
  ["nav_msgs/Path", () => ({
    header: header("map"), poses: [poseStamped("map"), poseStamped("m"), poseStamped("")] })],
  ["nav_msgs/Path", () => ({ header: header("map"), poses: [] })],
  ["tf2_msgs/TFMessage", () => ({
    transforms: [transform("map", "odom"), transform("odom", "base")] })],
  ["tf2_msgs/TFMessage", () => ({ transforms: [] })],
  ["sensor_msgs/PointCloud2", () => ({
    header: header("map"), height: 1, width: 2,
    fields: [{ name: "x", offset: 0, datatype: 7, count: 1 },
             { name: "rgb", offset: 4, datatype: 7, count: 1 }],
    is_bigendian: false, point_step: 8, row_step: 16,
    data: Uint8Array.from(Array.from({ length: 16 }, (_, k) => k)), is_dense: true })],
  ["sensor_msgs/PointCloud2", () => ({
    header: header("m"), height: 0, width: 0, fields: [], is_bigendian: true, point_step: 0,
    row_step: 0, data: new Uint8Array(), is_dense: false })],
  ["diagnostic_msgs/DiagnosticArray", () => ({
    header: header(""), status: [
      { level: 1, name: "a: odometry", message: "late", hardware_id: "a",
        values: [{ key: "poses", value: "12" }, { key: "", value: "x" }] },
      { level: 0, name: "b", message: "", hardware_id: "", values: [] }] })],
  ["visualization_msgs/Marker", () => marker("mesh", 3)],
  ["visualization_msgs/MarkerArray", () => ({ markers: [marker("kept", 0), marker("a", 2)] })],
  ["nav_msgs/OccupancyGrid", () => ({
    header: header("map"),
    info: { map_load_time: { sec: 1700000001, nanosec: 123456789 }, resolution: 0.25, width: 3,
            height: 1, origin: pose() },
    data: Int8Array.from([-1, 0, 100]) })],
  ["rcl_interfaces/Log", () => ({
    stamp: { sec: 1700000001, nanosec: 123456789 }, level: 30, name: "vio", msg: "slow",
    file: "", function: "f", line: 7 })],
];

for (const [type, make] of messages) {
  next = 0.5;
  const message = make();
  const definition = closure(type);
  const bytes = new MessageWriter(definition).writeMessage(message);
  const plain = (value) =>
    JSON.parse(JSON.stringify(value, (_, v) => (ArrayBuffer.isView(v) ? Array.from(v) : v)));
  assert.deepStrictEqual(plain(new MessageReader(definition).readMessage(bytes)), plain(message));
  console.log(`${type} cdr ${Buffer.from(bytes).toString("hex")}`);
}
