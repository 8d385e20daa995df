#include "modules/sensors/euroc_reader.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "modules/core/imu_limits.hpp"
#include "modules/core/input_file.hpp"
#include "modules/sensors/image_folder.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {
namespace {

std::variant<ImuSample, RowFault> parse_imu(const TextRow& row) {
  Vector6 values;
  for (int i = 0; i < 6; ++i) {
    const std::string_view field = row.fields[static_cast<std::size_t>(i) + 1];
    const auto value = parse_double(field);
    if (!value)
      return RowFault{ReaderFault::kMalformedRow, std::string(field) + " is not a number"};
    values[i] = *value;
  }
  const ImuSample sample{0, values.head<3>(), values.tail<3>()};
  if (!values.allFinite()) return RowFault{ReaderFault::kNotFinite, "not finite"};
  if (is_plausible(sample)) return sample;
  std::ostringstream why;
  why << sample.gyro.stableNorm() << " rad/s (at most " << kMaxAngularRate_radps << "), "
      << sample.accel.stableNorm() << " m/s^2 (at most " << kMaxSpecificForce_mps2 << ')';
  return RowFault{ReaderFault::kImplausible, why.str()};
}

ImuStream read_imu(const std::filesystem::path& file, ReaderReport& report) {
  ImuStream stream;
  for (const auto& row :
       read_ordered_rows<ImuSample>(file, 7, "holds no inertial sample", report, parse_imu))
    stream.add({row.stamp, row.value.gyro, row.value.accel});
  return stream;
}

bool is_rgbd(const SensorRig& rig) {
  return rig.stereo.depth_source == DepthSource::kDepthImage;
}

// Recordings in `folder`, for the message if the user named a folder of recordings.
std::string recordings_below(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (is_folder(entry->path() / "mav0")) names.push_back(entry->path().filename().string());
  std::ranges::sort(names);
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(names.size(), kMost); ++k)
    text += (k == 0 ? ", but in it are " : ", ") + names[k];
  return text + (names.size() > kMost ? " and others" : "");
}

}  // namespace

std::filesystem::path find_mav0(const std::filesystem::path& folder) {
  if (!is_folder(folder)) throw DatasetError(folder.string() + ": no such folder");
  if (is_folder(folder / "mav0")) return folder / "mav0";
  if (is_folder(folder / "cam0")) return folder;
  throw DatasetError(folder.string() +
                     ": neither a folder mav0 nor cam0 in it: not a recording in " + kKnownLayouts +
                     recordings_below(folder));
}

EurocReader::EurocReader(const std::filesystem::path& folder, EurocCalibration calibration,
                         const EurocOptions& options)
    : mav0_(find_mav0(folder)),
      rig_(std::move(calibration.rig)),
      side_images_(mav0_, rig_.depth, calibration.depth_scale_m, options.labels),
      files_(is_rgbd(rig_) ? StereoPairFiles{list_euroc_lefts(mav0_, report_), {}}
                           : list_euroc_pairs(mav0_, report_)),
      reads_imu_(options.imu && rig_.has_imu),
      imu_(reads_imu_ ? read_imu(mav0_ / "imu0" / "data.csv", report_) : ImuStream()) {
  side_images_.list(files_.pairs, report_);
  check_depth_images(mav0_, rig_.stereo, files_.pairs);
  for (StereoPairFile& pair : files_.pairs) pair.stamp += nanoseconds(options.correction.offset_s);
  keep_part({options.from_s, options.to_s, options.not_before}, mav0_, files_.pairs);
}

bool EurocReader::has_imu(const StereoPairFile& pair) {
  if (!reads_imu_) return true;
  const bool starts_by = imu_.starts_by(pair.stamp);
  if (starts_by && imu_.reaches(pair.stamp)) return true;
  report_.add(ReaderFault::kPairWithoutImu, at_line(mav0_ / "cam0" / "data.csv", pair.line) +
                                                ": the inertial samples " +
                                                (starts_by ? "end before it" : "start later"));
  return false;
}

std::vector<ImuSample> EurocReader::imu_until(Stamp stamp) {
  if (!reads_imu_) return {};
  std::vector<ImuSample> samples = imu_.until(stamp);
  report_gaps(samples, rig_.imu.rate_hz, (mav0_ / "imu0" / "data.csv").string(), report_);
  return samples;
}

std::vector<std::string> EurocReader::remarks() const {
  if (!is_remarkable(files_.synchrony)) return {};
  return {to_string(files_.synchrony, "right")};
}

std::optional<SensorPacket> EurocReader::next(const ChooseUse& choose) {
  while (next_pair_ < files_.pairs.size()) {
    const StereoPairFile& pair = files_.pairs[next_pair_++];
    if (!has_imu(pair)) continue;
    const FrameUse use = choose(pair.stamp, 0);
    if (use == FrameUse::kNone) continue;
    LoadedImage<StereoFrame> loaded = load_stereo_pair(pair, rig_.stereo);
    if (loaded.status != ImageStatus::kOk) {
      report_.add(fault_of(loaded.status),
                  at_line(mav0_ / "cam0" / "data.csv", pair.line) + ": " + loaded.problem);
      continue;
    }
    if (use == FrameUse::kAll || is_rgbd(rig_)) side_images_.load(pair, loaded.image, report_);
    return SensorPacket{std::make_shared<const StereoFrame>(std::move(loaded.image)),
                        imu_until(pair.stamp)};
  }
  return std::nullopt;
}

}  // namespace km
