#include "modules/diagnosis/examine_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "modules/core/text_table.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/evaluation/statistics.hpp"
#include "modules/recordings/bag_summary.hpp"

namespace km {
namespace {

using enum Severity;

void examine_fault(ReaderFault fault, const ReaderReport::Entry& entry, double of,
                   Examination& result) {
  constexpr double kFew = 0.01, kHalf = 0.5;
  const double share = static_cast<double>(entry.count) / std::max(of, 1.0);
  std::string id = std::string("recording.") + to_string(fault);  // "recording.missing_images"
  std::ranges::replace(id, ' ', '_');
  result.add(share > kHalf  ? kError
             : share > kFew ? kWarning
                            : kNote,
             std::move(id),
             std::to_string(entry.count) + ' ' + to_string(fault) + ", " + percent(share) +
                 ", first: " + entry.first,
             "the affected parts are skipped",
             "repair the recording, or record again if there are many");
}

// Number of usable items of the kind that a fault counts. Images are counted per camera, lost
// messages per topic.
double usable_count(ReaderFault fault, const SensorSample& sample) {
  const auto frames = static_cast<double>(sample.frames.size());
  const auto samples = static_cast<double>(sample.imu.size());
  const double images = sample.right_size.width > 0 ? 2.0 * frames : frames;
  switch (fault) {
    case ReaderFault::kNotFinite:
    case ReaderFault::kImplausible:
    case ReaderFault::kNoAcceleration:
    case ReaderFault::kImuGap:
      return samples;
    case ReaderFault::kMissingBetween:
      return images;
    case ReaderFault::kLostMessage:
      return images + samples;
    default:
      return frames;
  }
}

void examine_rate(const char* sensor, const std::string& id, const std::vector<Stamp>& stamps,
                  double least_hz, double longest_gap_s, Examination& result) {
  const StampStatistics found = stamp_statistics(stamps);
  result.figure(std::string(sensor) + ", rate", fixed(found.rate_hz, 1) + " Hz, largest gap " +
                                                    fixed(found.largest_gap_s, 3) + " s, jitter " +
                                                    milliseconds(found.jitter_s));
  if (!(found.rate_hz >= least_hz))
    result.add(kWarning, id + ".rate",
               std::string(sensor) + " at " + fixed(found.rate_hz, 1) + " Hz, less than " +
                   fixed(least_hz, 0) + " Hz",
               "odometry may lose track in fast motion", "record at a higher rate");
  if (found.largest_gap_s > longest_gap_s)
    result.add(kWarning, id + ".gap",
               std::string(sensor) + " with a gap of " + fixed(found.largest_gap_s, 2) + " s",
               "odometry may lose track in the gap and start again",
               "find out why the driver or the disk stopped; --from and --to choose a part "
               "without the gap");
}

std::vector<double> values_of(const std::vector<ImageQuality>& qualities, const auto& value) {
  std::vector<double> values;
  values.reserve(qualities.size());
  for (const ImageQuality& image : qualities) values.push_back(static_cast<double>(value(image)));
  return values;
}

}  // namespace

Examination examine_streams(const SensorSample& sample, const ReaderReport& report) {
  Examination result;
  if (sample.frames.empty())
    result.add(kError, "recording.no_frames", "no frame could be read",
               "there are no images to estimate motion from",
               "the other findings state the skipped parts");
  for (const auto& [fault, entry] : report.entries())
    examine_fault(fault, entry, usable_count(fault, sample) + static_cast<double>(entry.count),
                  result);
  constexpr double kFrames_hz = 8.0, kFrameGap_s = 0.25, kSamples_hz = 80.0, kSampleGap_s = 0.05;
  if (sample.frames.size() > 1)
    examine_rate("images", "frames", sample.frames, kFrames_hz, kFrameGap_s, result);
  std::vector<Stamp> stamps;
  stamps.reserve(sample.imu.size());
  for (const ImuSample& measured : sample.imu) stamps.push_back(measured.stamp);
  if (stamps.size() > 1)
    examine_rate("inertial samples", "imu", stamps, kSamples_hz, kSampleGap_s, result);
  return result;
}

Examination examine_images(const SensorSample& sample) {
  Examination result;
  if (sample.qualities.empty()) return result;
  const auto median = [&](const auto& value) {
    return quantile(values_of(sample.qualities, value), 0.5);
  };
  const double level = median([](const ImageQuality& image) { return image.mean_level; });
  const double saturated = median([](const ImageQuality& image) { return image.saturated_share; });
  const double sharpness = median([](const ImageQuality& image) { return image.sharpness; });
  const double corners = quantile(
      values_of(sample.qualities, [](const ImageQuality& image) { return image.corners; }), 0.2);
  result.figure("exposure",
                "mean level " + fixed(level, 0) + " of 255, " + percent(saturated) + " saturated");
  result.figure("sharpness", fixed(sharpness, 2) + " (0.5 blurred, 1 sharp)");
  result.figure("corners", fixed(corners, 0) + " in four images of five, or more");
  constexpr double kDark = 25.0, kBright = 225.0, kSaturated = 0.35, kBlurred = 0.58;
  constexpr double kFewCorners = 100.0;
  if (level < kDark)
    result.add(kWarning, "images.dark", "a mean grey level of " + fixed(level, 0) + " of 255",
               "few features are found, and some of them are noise",
               "use a longer exposure, more gain or more light");
  if (level > kBright || saturated > kSaturated)
    result.add(kWarning, "images.bright",
               percent(saturated) + " of the pixels are saturated, mean level " + fixed(level, 0),
               "saturated areas have no features", "use a shorter or automatic exposure");
  if (sharpness < kBlurred)
    result.add(kWarning, "images.blurred",
               "edges are blurred: sharpness " + fixed(sharpness, 2) + ", below 0.58",
               "features are less accurate, and fewer are tracked",
               "focus and clean the lens, or use a shorter exposure");
  if (corners < kFewCorners)
    result.add(kWarning, "images.few_corners",
               "less than " + fixed(corners + 1.0, 0) + " corners in one image of five",
               "odometry may lose track in areas without texture",
               "add texture or light, or lower tracker.fast_threshold");
  return result;
}

Examination examine_words(std::span<const std::vector<BinaryDescriptor>> images,
                          const Vocabulary& vocabulary) {
  std::map<std::uint32_t, double> counts;
  double features = 0.0;
  for (const std::vector<BinaryDescriptor>& image : images)
    for (const std::uint32_t word : vocabulary.words(image)) {
      ++counts[word];
      ++features;
    }
  constexpr double kEnough = 1000.0;
  if (features < kEnough)
    return {.figures = {{"vocabulary", "not determined: " + fixed(features, 0) + " features"}},
            .findings = {}};
  double entropy = 0.0;
  for (const auto& [word, count] : counts) entropy -= count / features * std::log(count / features);
  const double words = std::exp(entropy);
  const double most = std::min(features, static_cast<double>(vocabulary.size()));
  Examination result;
  result.figure("vocabulary", fixed(words, 0) + " words distinguish " + fixed(features, 0) +
                                  " features, of " + std::to_string(vocabulary.size()));
  constexpr double kLeastWords = 200.0, kLeastShare = 0.05;
  if (words < kLeastWords || words < kLeastShare * most)
    result.add(kWarning, "vocabulary.coverage",
               "the vocabulary distinguishes " + fixed(features, 0) + " features by only " +
                   fixed(words, 0) + " words",
               "different places look alike, so candidates are few or wrong",
               "train a vocabulary on images like these: kimera_multi_vocabulary "
               "train");
  return result;
}

}  // namespace km
