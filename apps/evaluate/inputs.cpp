#include "apps/evaluate/inputs.hpp"

#include <CLI/Error.hpp>
#include <algorithm>
#include <deque>
#include <iostream>
#include <string_view>
#include <utility>

#include "apps/output_file.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/evaluation/trajectory_error.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/images/image_codec.hpp"
#include "modules/mesh/mesh_file.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// A topic of a record, "team.mcap:/alice/path" on the command line.
struct RecordTopic {
  fs::path file;
  std::string topic;

  // Name of the robot: "alice".
  [[nodiscard]] std::string robot() const { return topic.substr(1, topic.find('/', 1) - 1); }
};

// nullopt for a text without this form.
std::optional<RecordTopic> split_record(const fs::path& input) {
  constexpr std::string_view kEnding = ".mcap";
  const std::string text = input.string();
  const std::size_t at = text.find(std::string(kEnding) + ":/");
  if (at == text.npos) return std::nullopt;
  const std::size_t end = at + kEnding.size();
  return RecordTopic{text.substr(0, end), text.substr(end + 1)};
}

StampedPose pose_of(Stamp stamp, const RosPose& pose) {
  return {stamp, make_pose(pose.orientation.normalized().toRotationMatrix(), pose.position)};
}

// Appends the pose of a message to `poses`, or replaces `poses` by those of a path.
void take(const BagChannel& channel, const BagMessage& message, const std::string& place,
          std::vector<StampedPose>& poses) {
  const auto decode = [&]<typename Message>(const Message&) {
    auto read = decode_ros<Message>(channel.encoding, message.bytes);
    if (!read.value) throw InputFileError(place + ": " + read.refusal);
    return *std::move(read.value);
  };
  if (is_of_type(channel, RosPath::kType)) {
    poses.clear();
    for (const RosPoseStamped& pose : decode(RosPath()).poses)
      poses.push_back(pose_of(pose.header.stamp, pose.pose));
  } else if (is_of_type(channel, RosOdometry::kType)) {
    const RosOdometry odometry = decode(RosOdometry());
    poses.push_back(pose_of(odometry.header.stamp, odometry.pose.pose));
  } else if (is_of_type(channel, RosPoseStamped::kType)) {
    const RosPoseStamped pose = decode(RosPoseStamped());
    poses.push_back(pose_of(pose.header.stamp, pose.pose));
  } else if (is_of_type(channel, RosPoseWithCovarianceStamped::kType)) {
    const RosPoseWithCovarianceStamped pose = decode(RosPoseWithCovarianceStamped());
    poses.push_back(pose_of(pose.header.stamp, pose.pose.pose));
  } else {
    throw InputFileError(place + ": " + channel.type + " has no poses");
  }
}

std::vector<StampedPose> read_topic(const RecordTopic& record) {
  const auto reader = open_mcap(record.file);
  const std::string place = record.file.string() + ':' + record.topic;
  std::vector<StampedPose> poses;
  while (const auto message = reader->next()) {
    const BagChannel& channel = reader->channels()[message->channel];
    if (channel.topic == record.topic) take(channel, *message, place, poses);
  }
  if (poses.empty()) throw InputFileError(place + ": no pose on this topic");
  std::ranges::stable_sort(poses, {}, &StampedPose::stamp);
  const auto equal = [](const auto& a, const auto& b) { return a.stamp == b.stamp; };
  poses.erase(std::unique(poses.begin(), poses.end(), equal), poses.end());
  return poses;
}

std::vector<fs::path> trajectories_in(const fs::path& file) {
  const auto reader = open_mcap(file);
  const auto name = [&file](const std::string& topic) {
    return fs::path(file.string() + ':' + topic);
  };
  std::vector<fs::path> found;
  for (const auto& [ending, type] :
       {std::pair("/path", RosPath::kType), std::pair("/odometry", RosOdometry::kType)}) {
    for (const BagChannel& channel : reader->channels())
      if (channel.topic.ends_with(ending) && is_of_type(channel, type))
        found.push_back(name(channel.topic));
    std::ranges::sort(found);
    if (!found.empty()) return found;
  }
  throw InputFileError(file.string() + ": neither /NAME/path nor /NAME/odometry in it");
}

}  // namespace

std::vector<fs::path> expand_records(const std::vector<fs::path>& inputs) {
  std::vector<fs::path> all;
  for (const fs::path& input : inputs) {
    const bool is_record = input.extension() == ".mcap" && !split_record(input);
    const std::vector<fs::path> found =
        is_record ? trajectories_in(input) : std::vector<fs::path>{input};
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

std::vector<StampedPose> read_estimate(const fs::path& input) {
  const std::vector<fs::path> found = expand_records({input});
  if (found.size() > 1)
    throw InputFileError(input.string() + ": has trajectories of " + std::to_string(found.size()) +
                         " robots: name one, as in " + found.front().string());
  if (const auto record = split_record(found.front())) return read_topic(*record);
  return read_trajectory(found.front());
}

std::vector<std::vector<StampedPose>> read_truths(const std::vector<fs::path>& files,
                                                  std::size_t count, const std::string& option) {
  if (files.size() != 1 && files.size() != count)
    throw CLI::ValidationError("give one --truth, or as many as there are " + option);
  std::vector<std::vector<StampedPose>> truths;
  for (const fs::path& file : files) truths.push_back(read_trajectory(file));
  return truths;
}

std::string short_name(const fs::path& file) {
  if (const auto recorded = split_record(file))
    return (recorded->file.stem() / recorded->robot()).string();
  const fs::path folder = fs::absolute(file).parent_path().filename();
  return (folder / file.stem()).string();
}

SE3 placement_of(const std::vector<fs::path>& trajectories, const std::vector<fs::path>& references,
                 bool one_for_all) {
  if (references.empty()) return SE3::Identity();
  const bool shared = one_for_all && references.size() == 1;
  const std::size_t count = shared ? trajectories.size() : references.size();
  std::deque<std::vector<StampedPose>> poses;  // inputs refer to them
  std::vector<TrajectoryInput> inputs;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& reference = poses.emplace_back(read_trajectory(references[shared ? 0 : i]));
    const auto& estimate = poses.emplace_back(read_estimate(trajectories.at(i)));
    inputs.push_back({short_name(trajectories[i]), reference, estimate, std::nullopt});
  }
  return align_surroundings(inputs);
}

LabelPalette read_palette(fs::path file, const fs::path& mesh, std::span<const MeshInput> meshes) {
  if (file.empty()) {
    file = mesh.parent_path() / "label_palette.csv";
    if (is_absent(file)) return {};
  }
  LabelPalette palette = parse_label_palette(read_input_file(file), file.string());
  for (const MeshInput& input : meshes)
    check_labels(input.mesh, input.name, palette, file.string());
  return palette;
}

LabelledMesh read_shown_mesh(const fs::path& file) {
  std::vector<std::string> notes;
  LabelledMesh mesh = without_far_vertices(read_mesh(file), file.string(), notes);
  for (const std::string& note : notes) std::cout << "note: " << note << '\n';
  return mesh;
}

LabelledMesh read_meshes(const std::vector<fs::path>& files) {
  LabelledMesh all;
  for (const fs::path& file : files) all.append(read_shown_mesh(file));
  return all;
}

void write_png(const fs::path& file, const cv::Mat& picture) {
  const std::vector<std::uint8_t> png = encode_png(picture);
  write_file(file, {reinterpret_cast<const char*>(png.data()), png.size()});
}

}  // namespace km
