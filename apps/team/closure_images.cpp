#include "apps/team/closure_images.hpp"

#include <algorithm>
#include <exception>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <set>
#include <stdexcept>

#include "modules/images/image_codec.hpp"
#include "modules/images/image_view.hpp"
#include "modules/recordings/open_bag.hpp"
#include "modules/recordings/ros_messages.hpp"
#include "modules/sensors/folder_layouts.hpp"
#include "modules/sensors/node/open_folder.hpp"
#include "modules/sensors/node/rig_file.hpp"
#include "modules/sensors/sensor_messages.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// The verified closures that show most come first: those that were rejected, those between robots,
// then those of one robot.
std::vector<ClosureId> verified_closures(const std::vector<RobotResult>& robots) {
  std::map<ClosureId, ClosureStage> stages;  // two robots may have the same candidate
  for (const RobotResult& robot : robots)
    for (const ClosureRecord& closure : robot.closures) {
      ClosureStage& stage = stages[closure.id];
      stage = std::max(stage, closure.stage);
    }
  std::erase_if(stages, [](const auto& one) { return one.second < ClosureStage::kVerified; });
  std::vector<ClosureId> closures;
  for (const auto& [id, stage] : stages) closures.push_back(id);
  std::ranges::stable_sort(closures, {}, [&](const ClosureId& id) {
    return stages.at(id) == ClosureStage::kVerified ? 0 : id.from.robot != id.to.robot ? 1 : 2;
  });
  return closures;
}

// Wanted: keyframes whose left images are requested, by stamp. Take: function called with each of
// these images.
using Wanted = std::map<Stamp, KeyframeId>;
using Take = std::function<void(const KeyframeId&, const cv::Mat&)>;

// `problems` receives the reason for each image that cannot be read.
void read_images(const RobotPlan& plan, const Wanted& wanted, const Take& take,
                 std::vector<std::string>& problems) {
  const fs::path rig = argument_of(plan, "--rig");
  const bool is_euroc = layout_of(plan.dataset) == FolderLayout::kEuroc;
  const double offset_s = rig.empty() || !is_euroc ? 0.0 : read_rig_correction(rig).offset_s;
  ReaderReport report;
  for (const StereoPairFile& file : is_euroc ? list_euroc_lefts(find_mav0(plan.dataset), report)
                                             : read_folder(plan.dataset, {}, rig).frames)
    if (const auto at = wanted.find(file.stamp + nanoseconds(offset_s)); at != wanted.end()) {
      try {
        take(at->second, read_pixels(file.left, DecodedPixels::kEightBits));
      } catch (const std::runtime_error& error) {
        problems.emplace_back(error.what());
      }
    }
}

void read_bag(const RobotPlan& plan, const Wanted& wanted, const Take& take) {
  const fs::path file = argument_of(plan, "--rig");
  if (file.empty()) throw std::runtime_error(plan.dataset.string() + ": no --rig");
  const PartialRig partial = read_rig_file(file);
  const Rig rig = partial.is_complete()
                      ? partial.rig
                      : complete_rig(plan.dataset.string(), *open_bag(plan.dataset), partial);
  const Camera& camera = rig.sensors.stereo.cameras[0];
  const auto bag = open_bag(plan.dataset);
  while (const auto message = bag->next()) {
    const BagChannel& channel = bag->channels()[message->channel];
    if (channel.topic != rig.topics.left) continue;
    const auto header = decode_ros<RosHeader>(channel.encoding, message->bytes);
    if (!header.value) continue;
    const auto at = wanted.find(header.value->stamp + nanoseconds(rig.camera_time_offset_s));
    if (at == wanted.end()) continue;
    const ImageResult image =
        gray_of_message(channel, *message, plan.dataset.string(), {camera.width, camera.height});
    if (!image.fault) take(at->second, view(image.image));
  }
}

std::string small_jpeg(const cv::Mat& image, const ClosureImageOptions& options) {
  const double scale = std::min(1.0, static_cast<double>(options.width_px) / image.cols);
  cv::Mat small;
  cv::resize(image, small, {}, scale, scale, cv::INTER_AREA);
  const std::vector<std::uint8_t> bytes = encode_jpeg(small, options.quality);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

ClosureImages closure_images(const std::vector<RobotResult>& robots,
                             const ClosureImageOptions& options) {
  ClosureImages images;
  std::vector<ClosureId> closures = verified_closures(robots);
  if (closures.size() > options.max_closures) {
    images.notes.push_back("images are shown of " + std::to_string(options.max_closures) + " of " +
                           std::to_string(closures.size()) + " closures that were verified");
    closures.resize(options.max_closures);
  }
  std::set<KeyframeId> shown;
  for (const ClosureId& closure : closures) shown.insert({closure.from, closure.to});
  for (const RobotResult& robot : robots) {
    Wanted wanted;
    for (const KeyframeRecord& keyframe : robot.keyframes)
      if (shown.contains(keyframe.id)) wanted.emplace(keyframe.stamp, keyframe.id);
    if (wanted.empty() || robot.plan.dataset.empty()) continue;
    const Take take = [&](const KeyframeId& keyframe, const cv::Mat& image) {
      images.jpegs[keyframe] = small_jpeg(image, options);
    };
    std::vector<std::string> problems;
    try {
      may_be_bag(robot.plan.dataset) ? read_bag(robot.plan, wanted, take)
                                     : read_images(robot.plan, wanted, take, problems);
    } catch (const std::exception& error) {
      images.notes.push_back(robot.plan.name + ": no images of its closures: " + error.what());
    }
    if (!problems.empty())
      images.notes.push_back(robot.plan.name + ": " + std::to_string(problems.size()) +
                             " images of its closures cannot be read, the first: " + problems[0]);
  }
  return images;
}

}  // namespace km
