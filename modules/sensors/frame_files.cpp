#include "modules/sensors/frame_files.hpp"

#include <cmath>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "modules/core/input_file.hpp"
#include "modules/core/text_table.hpp"
#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/image_file.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

struct ListedImage {
  Stamp stamp = 0;
  int line = 0;
  std::filesystem::path file;
};

std::vector<ListedImage> list_images(const std::filesystem::path& camera, ReaderReport& report) {
  std::vector<ListedImage> images;
  const std::filesystem::path list = camera / "data.csv";
  using Parsed = std::variant<std::filesystem::path, RowFault>;
  const auto file_of = [&](const TextRow& row) -> Parsed {
    return camera / "data" / row.fields[1];
  };
  for (auto& row :
       read_ordered_rows<std::filesystem::path>(list, 2, "lists no image", report, file_of))
    images.push_back({row.stamp, row.line, std::move(row.value)});
  return images;
}

std::vector<Stamp> stamps_of(const std::vector<ListedImage>& images) {
  std::vector<Stamp> stamps;
  stamps.reserve(images.size());
  for (const ListedImage& image : images) stamps.push_back(image.stamp);
  return stamps;
}

LabelPalette read_palette(const std::filesystem::path& file) {
  if (is_absent(file)) return {};
  try {
    return parse_label_palette(read_file(file), file.string());
  } catch (const std::invalid_argument& error) {
    throw DatasetError(error.what());
  }
}

}  // namespace

void keep_part(const RecordingPart& part, const std::filesystem::path& recording,
               std::vector<StereoPairFile>& frames) {
  part.check(recording.string());
  const Stamp start = frames.front().stamp;
  const double end_s = seconds_between(start, frames.back().stamp);
  std::erase_if(frames, [&](const StereoPairFile& frame) {
    const double t_s = seconds_between(start, frame.stamp);
    return t_s < part.from_s || t_s >= part.to_s ||
           (part.not_before && frame.stamp < *part.not_before);
  });
  if (!frames.empty()) return;
  std::ostringstream message;
  message << recording.string() << ": no stereo pair from " << part.from_s << " s to "
          << (std::isinf(part.to_s) ? "the end" : fixed(part.to_s, 3) + " s")
          << "; the recording has them from 0 s to " << end_s << " s";
  throw DatasetError(message.str());
}

void check_depth_images(const std::filesystem::path& recording, const StereoRig& rig,
                        const std::vector<StereoPairFile>& frames) {
  if (rig.depth_source != DepthSource::kDepthImage) return;
  const StereoPairFile* first = nullptr;  // first frame whose depth image is missing
  for (const StereoPairFile& frame : frames) {
    if (is_file(frame.depth)) return;
    if (first == nullptr && !frame.depth.empty()) first = &frame;
  }
  throw DatasetError(recording.string() + ": no depth image for any of " +
                     std::to_string(frames.size()) + " images" +
                     (first != nullptr ? ", first: " + first->depth.string() + ": no such image"
                                       : ": the stamps of depth images are too far away"));
}

StereoPairFiles list_euroc_pairs(const std::filesystem::path& mav0, ReaderReport& report) {
  const auto lefts = list_images(mav0 / "cam0", report);
  const auto rights = list_images(mav0 / "cam1", report);
  const Synchrony synchrony = find_synchrony(stamps_of(lefts), stamps_of(rights));
  const auto count_unpaired = [&](ReaderFault fault, const char* camera, const ListedImage& image) {
    report.add(fault, at_line(mav0 / camera / "data.csv", image.line) + ": " +
                          image.file.filename().string());
  };
  std::vector<StereoPairFile> pairs;
  auto left = lefts.begin();
  auto right = rights.begin();
  while (left != lefts.end() || right != rights.end()) {
    const bool no_left = left == lefts.end();
    const bool no_right = right == rights.end();
    const double off_s =
        no_left || no_right ? 0.0 : seconds_between(left->stamp, right->stamp) - synchrony.offset_s;
    if (no_right || off_s > synchrony.tolerance_s) {
      count_unpaired(ReaderFault::kLeftWithoutRight, "cam0", *left++);
    } else if (no_left || off_s < -synchrony.tolerance_s) {
      count_unpaired(ReaderFault::kRightWithoutLeft, "cam1", *right++);
    } else {
      pairs.push_back({left->stamp, left->file, right->file, left->line, {}, {}});
      ++left, ++right;
    }
  }
  if (pairs.empty())
    throw DatasetError(mav0.string() + ": no image of cam0 has one of cam1 within " +
                       std::to_string(synchrony.tolerance_s) + " s");
  return {std::move(pairs), synchrony};
}

std::vector<StereoPairFile> list_euroc_lefts(const std::filesystem::path& mav0,
                                             ReaderReport& report) {
  std::vector<StereoPairFile> frames;
  for (ListedImage& left : list_images(mav0 / "cam0", report))
    frames.push_back({left.stamp, std::move(left.file), {}, left.line, {}, {}});
  return frames;
}

void list_beside(const std::filesystem::path& folder, std::filesystem::path StereoPairFile::*member,
                 std::vector<StereoPairFile>& frames, ReaderReport& report) {
  constexpr double kTolerance_s = 1e-3;
  auto frame = frames.begin();
  for (ListedImage& image : list_images(folder, report)) {
    while (frame != frames.end() && seconds_between(frame->stamp, image.stamp) > kTolerance_s)
      ++frame;
    if (frame == frames.end() || seconds_between(frame->stamp, image.stamp) < -kTolerance_s) {
      report.add(ReaderFault::kImageWithoutFrame,
                 at_line(folder / "data.csv", image.line) + ": " + image.file.filename().string());
      continue;
    }
    (*frame++).*member = std::move(image.file);
  }
}

LoadedImage<StereoFrame> load_stereo_pair(const StereoPairFile& files, const StereoRig& rig) {
  LoadedImage<StereoFrame> result;
  result.image.stamp = files.stamp;
  const std::pair<const std::filesystem::path&, GrayImage&> images[] = {
      {files.left, result.image.left}, {files.right, result.image.right}};
  const std::size_t count = rig.depth_source == DepthSource::kRightImage ? 2 : 1;
  for (std::size_t i = 0; i < count; ++i) {
    const Camera& camera = rig.cameras[i];
    ImageResult loaded = load_gray_image(images[i].first, camera.width, camera.height);
    if (loaded.status != ImageStatus::kOk) return {loaded.status, std::move(loaded.problem), {}};
    images[i].second = std::move(loaded.image);
  }
  return result;
}

DepthAndLabelImages::DepthAndLabelImages(const std::filesystem::path& mav0,
                                         const std::optional<DepthRange>& depth,
                                         double depth_scale_m, bool labels)
    : mav0_(mav0), depth_(depth), depth_scale_m_(depth_scale_m), labels_(labels) {
  if (labels_) palette_ = read_palette(mav0 / "label_palette.csv");
}

void DepthAndLabelImages::list(std::vector<StereoPairFile>& frames, ReaderReport& report) const {
  if (depth_) list_beside(mav0_ / "depth0", &StereoPairFile::depth, frames, report);
  if (labels_) list_beside(mav0_ / "label0", &StereoPairFile::labels, frames, report);
}

void DepthAndLabelImages::load(const StereoPairFile& files, StereoFrame& frame,
                               ReaderReport& report) const {
  if (!files.depth.empty()) load_depth(files.depth, frame, report);
  if (!files.labels.empty()) load_labels(files.labels, frame, report);
}

void DepthAndLabelImages::load_depth(const std::filesystem::path& file, StereoFrame& frame,
                                     ReaderReport& report) const {
  DepthResult loaded =
      load_depth_image(file, frame.left.width, frame.left.height, depth_scale_m_, *depth_);
  if (loaded.status == ImageStatus::kOk)
    frame.depth = std::make_shared<const DepthImage>(std::move(loaded.image));
  else
    report.add(fault_of(loaded.status), loaded.problem);
}

void DepthAndLabelImages::load_labels(const std::filesystem::path& file, StereoFrame& frame,
                                      ReaderReport& report) const {
  LabelResult loaded = load_label_image(file, frame.left.width, frame.left.height, palette_);
  if (loaded.unknown_pixels > 0)
    report.add(ReaderFault::kUnknownColor,
               file.string() + ": " + std::to_string(loaded.unknown_pixels) + " pixels");
  if (loaded.status == ImageStatus::kOk)
    frame.labels = std::make_shared<const LabelImage>(std::move(loaded.image));
  else
    report.add(fault_of(loaded.status), loaded.problem);
}

}  // namespace km
