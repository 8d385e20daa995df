#include "modules/sensors/image_folder.hpp"

#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include "modules/core/input_file.hpp"
#include "modules/core/text_table.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

// Precondition: `frames` is not empty.
void keep_part(const RecordingPart& part, const std::string& recording,
               std::vector<StereoPairFile>& frames) {
  part.check(recording);
  const Stamp start = frames.front().stamp;
  const double end_s = seconds_between(start, frames.back().stamp);
  std::erase_if(frames, [&](const StereoPairFile& frame) {
    const double t_s = seconds_between(start, frame.stamp);
    return t_s < part.from_s || t_s >= part.to_s ||
           (part.not_before && frame.stamp < *part.not_before);
  });
  if (!frames.empty()) return;
  std::ostringstream message;
  message << recording << ": no stereo pair from " << part.from_s << " s to "
          << (std::isinf(part.to_s) ? "the end" : fixed(part.to_s, 3) + " s")
          << "; the recording has them from 0 s to " << end_s << " s";
  throw DatasetError(message.str());
}

// Throws unless a frame has its depth image on disk.
void check_depth_images(const std::string& recording, const std::vector<StereoPairFile>& frames) {
  const StereoPairFile* first = nullptr;  // first frame whose depth image is missing
  for (const StereoPairFile& frame : frames) {
    if (is_file(frame.depth)) return;
    if (first == nullptr && !frame.depth.empty()) first = &frame;
  }
  throw DatasetError(recording + ": no depth image for any of " + std::to_string(frames.size()) +
                     " images" +
                     (first != nullptr ? ", first: " + first->depth.string() + ": no such image"
                                       : ": the stamps of depth images are too far away"));
}

}  // namespace

LoadedImage<StereoFrame> load_stereo_pair(const StereoPairFile& files, const StereoRig& rig) {
  LoadedImage<StereoFrame> result;
  result.image.stamp = files.stamp;
  const std::pair<const fs::path&, GrayImage&> images[] = {{files.left, result.image.left},
                                                           {files.right, result.image.right}};
  const std::size_t count = rig.depth_source == DepthSource::kRightImage ? 2 : 1;
  for (std::size_t i = 0; i < count; ++i) {
    const Camera& camera = rig.cameras[i];
    ImageResult loaded = load_gray_image(images[i].first, camera.width, camera.height);
    if (loaded.status != ImageStatus::kOk) return {loaded.status, std::move(loaded.problem), {}};
    images[i].second = std::move(loaded.image);
  }
  return result;
}

FolderReader::FolderReader(ImageFolder folder, const RecordingPart& part)
    : folder_(std::move(folder)) {
  const std::string name = folder_.name.string();
  if (folder_.is_rgbd()) check_depth_images(name, folder_.frames);
  keep_part(part, name, folder_.frames);
}

bool FolderReader::has_imu(const StereoPairFile& files) {
  if (!folder_.rig.has_imu) return true;
  const bool starts_by = folder_.imu.starts_by(files.stamp);
  if (starts_by && folder_.imu.reaches(files.stamp)) return true;
  folder_.report.add(ReaderFault::kPairWithoutImu,
                     at_line(folder_.list, files.line) + ": the inertial samples " +
                         (starts_by ? "end before it" : "start later"));
  return false;
}

std::vector<ImuSample> FolderReader::imu_until(Stamp stamp) {
  if (!folder_.rig.has_imu) return {};
  std::vector<ImuSample> samples = folder_.imu.until(stamp);
  report_gaps(samples, folder_.rig.imu.rate_hz, folder_.imu_list.string(), folder_.report);
  return samples;
}

void FolderReader::load_depth(const fs::path& file, StereoFrame& frame) {
  DepthResult loaded = load_depth_image(file, frame.left.width, frame.left.height,
                                        folder_.depth_scale_m, *folder_.rig.depth);
  if (loaded.status == ImageStatus::kOk)
    frame.depth = std::make_shared<const DepthImage>(std::move(loaded.image));
  else
    folder_.report.add(fault_of(loaded.status), loaded.problem);
}

void FolderReader::load_labels(const fs::path& file, StereoFrame& frame) {
  LabelResult loaded = load_label_image(file, frame.left.width, frame.left.height, folder_.palette);
  if (loaded.unknown_pixels > 0)
    folder_.report.add(ReaderFault::kUnknownColor,
                       file.string() + ": " + std::to_string(loaded.unknown_pixels) + " pixels");
  if (loaded.status == ImageStatus::kOk)
    frame.labels = std::make_shared<const LabelImage>(std::move(loaded.image));
  else
    folder_.report.add(fault_of(loaded.status), loaded.problem);
}

std::optional<SensorPacket> FolderReader::next(const ChooseUse& choose) {
  while (next_ < folder_.frames.size()) {
    const StereoPairFile& files = folder_.frames[next_++];
    if (!has_imu(files)) continue;
    const FrameUse use = choose(files.stamp, 0);
    if (use == FrameUse::kNone) continue;
    LoadedImage<StereoFrame> loaded = load_stereo_pair(files, folder_.rig.stereo);
    if (loaded.status != ImageStatus::kOk) {
      folder_.report.add(fault_of(loaded.status),
                         at_line(folder_.list, files.line) + ": " + loaded.problem);
      continue;
    }
    const bool has_all = use == FrameUse::kAll || folder_.is_rgbd();
    if (has_all && !files.depth.empty()) load_depth(files.depth, loaded.image);
    if (has_all && !files.labels.empty()) load_labels(files.labels, loaded.image);
    return SensorPacket{std::make_shared<const StereoFrame>(std::move(loaded.image)),
                        imu_until(files.stamp)};
  }
  return std::nullopt;
}

}  // namespace km
