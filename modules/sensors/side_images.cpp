#include "modules/sensors/side_images.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "modules/sensors/dataset_reader.hpp"
#include "modules/sensors/depth_file.hpp"
#include "modules/sensors/euroc_rig.hpp"
#include "modules/sensors/label_file.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

LabelPalette read_palette(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return {};
  try {
    return parse_label_palette(read_file(file), file.string());
  } catch (const std::invalid_argument& error) {
    throw DatasetError(error.what());
  }
}

}  // namespace

SideImages::SideImages(const std::filesystem::path& mav0, const SensorRig& rig, bool labels)
    : mav0_(mav0), depth_(rig.depth), labels_(labels) {
  if (depth_) depth_scale_m_ = read_depth_scale(mav0);
  if (labels_) palette_ = read_palette(mav0 / "label_palette.csv");
}

void SideImages::list(double tolerance_s, std::vector<StereoPairFile>& frames,
                      ReaderReport& report) const {
  if (depth_) list_beside(mav0_ / "depth0", &StereoPairFile::depth, tolerance_s, frames, report);
  if (labels_) list_beside(mav0_ / "label0", &StereoPairFile::labels, tolerance_s, frames, report);
}

void SideImages::load(const StereoPairFile& files, StereoFrame& frame, ReaderReport& report) const {
  if (!files.depth.empty()) load_depth(files.depth, frame, report);
  if (!files.labels.empty()) load_labels(files.labels, frame, report);
}

void SideImages::load_depth(const std::filesystem::path& file, StereoFrame& frame,
                            ReaderReport& report) const {
  DepthResult loaded =
      load_depth_image(file, frame.left.width, frame.left.height, depth_scale_m_, *depth_);
  if (loaded.status == ImageStatus::kOk)
    frame.depth = std::make_shared<const DepthImage>(std::move(loaded.image));
  else
    report.add(fault_of(loaded.status), loaded.problem);
}

void SideImages::load_labels(const std::filesystem::path& file, StereoFrame& frame,
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
