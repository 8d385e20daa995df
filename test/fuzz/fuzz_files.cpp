// libFuzzer's entry for files: KM_FUZZ_READER names the kind of the file. See idl/README.md.
#include <cstdlib>

#include "apps/robot/robot_config.hpp"
#include "apps/robot/run_summary.hpp"
#include "apps/team/team_file.hpp"
#include "modules/absolute_fixes/fix_reader.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/evaluation/closure_truth.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/journal/restored_run.hpp"
#include "modules/link_emulation/link_trace.hpp"
#include "modules/map_2d/map_server_files.hpp"
#include "modules/mesh/map_file.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/objects/object_file.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/recorded_graph/jrl_io.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/security/credentials.hpp"
#include "modules/security/key_formats.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "modules/view/view_update.hpp"
#include "runtime/config_layers.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

// The input as a file of this name, in a folder in TMPDIR.
fs::path file(const std::string& name, const std::string& text) {
  static const TemporaryFolder folder;
  return folder.write(name, text);
}

// Another exception than Error ends the fuzzer.
template <typename Error = std::runtime_error>
void refusable(const auto& read) try {
  static_cast<void>(read());
} catch (const Error&) {
}

// As a robot does, with the calibration in the messages.
void read_sensors(const fs::path& bag) {
  PartialRig partial;
  partial.has_cameras = partial.has_extrinsics = partial.has_pair = false;
  SensorTopicNames& topics = partial.rig.topics;
  const auto channels = open_bag(bag)->channels();
  for (const BagChannel& channel : channels) {
    const bool is_depth = channel.topic.find("depth") != channel.topic.npos;
    if (has_images(channel))
      (is_depth ? topics.depth : topics.left.empty() ? topics.left : topics.right) = channel.topic;
    if (is_of_type(channel, RosImu::kType)) topics.imu = channel.topic;
    if (is_of_type(channel, RosOdometry::kType)) topics.odometry = channel.topic;
  }
  partial.info_topics = {camera_info_beside(topics.left), camera_info_beside(topics.right)};
  partial.depth_info_topic = camera_info_beside(topics.depth);
  BagDataset dataset("bag", open_bag(bag), complete_rig("bag", *open_bag(bag), partial));
  while (const auto packet = dataset.next())
    if (packet->frame->decode_color) packet->frame->decode_color();
}

void recordings(const std::string& text) {
  const fs::path bag = file("bag", text);
  refusable([&] { return pairs_of_images(summarise_topics(*open_bag(bag))); });
  refusable([&] { read_sensors(bag); });
  refusable([&] { return read_mcap_attachments(bag); });
}

void read_image_message(const BagChannel& channel, const Bytes& bytes) {
  const BagMessage message{.bytes = bytes};
  const ImageSize stated = topic_image(channel, message).value_or(TopicImage{}).size;
  cv::Size size(8, 6);  // that of RVL
  if (stated.width < 1000 && stated.height < 1000 && stated.width * stated.height > 0)
    size = cv::Size(static_cast<int>(stated.width), static_cast<int>(stated.height));
  static_cast<void>(gray_of_message(channel, message, "image", size));
  static_cast<void>(color_of_message(channel, message, size));
  static_cast<void>(depth_of_message(channel, message, "image", size, 1e-3, {}));
}

void images(const std::string& text) {
  for (const auto pixels :
       {DecodedPixels::kGray, DecodedPixels::kEightBits, DecodedPixels::kStored})
    refusable([&] { return decode_pixels(text, pixels); });
  refusable<std::invalid_argument>([&] { return map_of_image(text); });
  const Bytes bytes(text.begin(), text.end());
  for (const char* const encoding : {"ros1", "cdr"})
    read_image_message({"raw", std::string(RosImage::kType), encoding}, bytes);
  for (const char* const format :
       {"jpeg", "16UC1; compressedDepth png", "32FC1; compressedDepth rvl"})
    read_image_message(
        {"compressed", std::string(RosCompressedImage::kType), "cdr"},
        encode_ros(RosCompressedImage{.header = {}, .format = format, .data = bytes}));
}

void graphs(const std::string& text) {
  for (const char* const name : {"graph.g2o", "graph.csv"})
    refusable([&] { return odometry_poses(in_space(read_recorded_graph(file(name, text)))); });
  refusable([&] {
    const JrlGraph graph = parse_jrl(text, "jrl");
    for (const RobotId robot : graph.robots)
      refusable([&] { return odometry_poses(part_of(graph, robot, "jrl")); });
  });
}

void tables(const std::string& text) {
  const fs::path csv = file("table.csv", text), txt = file("table.txt", text);
  refusable([&] { return read_trajectory(csv); });
  refusable([&] { return read_uncertain_trajectory(txt); });
  refusable([&] { return read_uncertain_trajectory(txt, [](const std::string&) {}); });
  for (const FixSource source : {FixSource::kGnss, FixSource::kMotionCapture})
    for (const fs::path& path : {csv, txt})
      refusable([&] { return FixReader({.source = source, .file = path}).read(path); });
  refusable([&] { return read_keyframes(csv); });
  refusable([&] { return read_closures(csv); });
  refusable([&] { return parse_link_trace(text, "trace"); });
  refusable([&] { return parse_packet_schedule(text, "packets"); });
  refusable<std::invalid_argument>([&] { return parse_label_palette(text, "palette"); });
}

// The lists of a recording in a folder, beside one image.
void folders(const std::string& text) {
  static const Bytes png = encode_png(cv::Mat(48, 64, CV_8UC1, cv::Scalar(9)));
  static const fs::path image = file("image_0/000000.png", {png.begin(), png.end()});
  static const fs::path folder = image.parent_path().parent_path();
  for (const char* const name : {"calib.txt", "times.txt", "rgb.txt", "depth.txt", "cam0/data.csv",
                                 "cam1/data.csv", "imu0/data.csv", "depth0/data.csv"})
    file(name, text);
  refusable([&] { return read_kitti_folder(folder); });
  refusable([&] { return read_tum_folder(folder, tum_camera("freiburg1").value()); });
  SensorRig rig;
  refusable([&] { return list_euroc_folder(folder, rig, 1e-3, {}); });
  rig.stereo.depth_source = DepthSource::kDepthImage;
  refusable([&] { return list_euroc_folder(folder, rig, 1e-3, {.depth = true}); });
}

void meshes(const std::string& text) {
  std::vector<std::string> notes;
  refusable([&] { return without_far_vertices(read_mesh(file("mesh.ply", text)), "mesh", notes); });
  std::uint64_t sum = kFnv1aBasis;  // so that the content is read
  mix_fnv1a(sum, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  mix_fnv1a(sum, text.size());
  std::string map = "KMMAP3\n\n";
  for (unsigned byte = 0; byte < 8; ++byte) map += static_cast<char>(sum >> (8 * byte));
  refusable([&] { return read_map_file(file("map", map + text)); });
}

void settings(const std::string& text) {
  const fs::path yaml = file("settings.yaml", text);
  refusable<DatasetError>([&] { return read_rig({yaml}, {.may_be_partial = true}); });
  for (const char* const sensor : {"cam0", "cam1", "imu0", "depth0"})
    file(std::string("rig/") + sensor + "/sensor.yaml", text);
  refusable<DatasetError>([&] { return read_euroc_rig(yaml.parent_path() / "rig", true); });
  refusable([&] { return read_rig_file(yaml); });
  refusable([&] { return corrected_rig_text(yaml, read_rig_correction(yaml)); });
  refusable<ConfigError>([&] { return read_team_file(yaml, {}); });
  refusable<ConfigError>([&] {
    ConfigLayers layers;
    layers.add_file(yaml);
    RobotConfig().visit_sections(
        [&](auto& section) { section = layers.load<std::remove_cvref_t<decltype(section)>>(); });
    layers.finish();
  });
}

// The input is a whole journal, and also its entries, each after its length, without check sums.
void journals(const std::string& text) {
  refusable([&] { return restore_run(file("run.journal", text)); });
  RunRestorer restorer;
  ByteReader in({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  refusable<std::invalid_argument>([&] {
    while (in.left() > 0)
      if (auto entry = decode_journal_entry(in.bytes(in.u16())).value)
        restorer.take({.entry = *std::move(entry), .place = {}});
  });
  static_cast<void>(restorer.finish());
}

void results(const std::string& text) {
  const fs::path path = file("result", text);
  refusable([&] { return read_objects(path); });
  refusable([&] { return read_object_list(path); });
  refusable([&] { return read_summary(path); });
  refusable([&] { return deserialize(text, "vocabulary"); });
  refusable([&] { return read_secret_key(path); });
  refusable([&] { return read_certificate(path); });
  refusable([&] { return read_authority(path); });
  refusable([&] { return read_revocations(path); });
  static_cast<void>(parse_credentials(text));
  static_cast<void>(decode_view({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
}

const std::map<std::string, void (*)(const std::string&)> kReaders = {
    {"recordings", recordings}, {"images", images},     {"graphs", graphs},
    {"tables", tables},         {"folders", folders},   {"meshes", meshes},
    {"settings", settings},     {"journals", journals}, {"results", results}};

}  // namespace
}  // namespace km

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const char* const name = std::getenv("KM_FUZZ_READER");
  if (name == nullptr || !km::kReaders.contains(name))
    throw std::invalid_argument("KM_FUZZ_READER names no reader, see idl/README.md");
  static const auto read = km::kReaders.at(name);
  read({data, data + size});
  return 0;
}
