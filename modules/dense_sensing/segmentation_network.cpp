#include "modules/dense_sensing/segmentation_network.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "modules/core/io/text_rows.hpp"
#include "modules/images/configured_network.hpp"
#include "modules/images/image_view.hpp"

namespace km {
namespace {

constexpr NetworkKey kKey{"segmentation.network",
                          "leave segmentation.network empty to do without its labels"};
constexpr std::size_t kClasses = 256;  // largest number of classes, that of labels

std::array<std::optional<LabelId>, kClasses> labels_of(const SegmentationConfig& config) {
  std::array<std::optional<LabelId>, kClasses> labels;
  if (config.label_map.size() > kClasses)
    throw ConfigError("segmentation.label_map has " + std::to_string(config.label_map.size()) +
                      " entries, more than labels exist\n");
  for (std::size_t i = 0; i < config.label_map.size(); ++i) {
    const auto value = parse_int64(config.label_map[i]);
    if (!value || *value < 0 || *value > 255)
      throw ConfigError("segmentation.label_map: '" + config.label_map[i] + "' of class " +
                        std::to_string(i) + " is no label from 0 to 255\n");
    labels[i] = static_cast<LabelId>(*value);
  }
  if (config.label_map.empty())
    for (std::size_t i = 0; i < kClasses; ++i) labels[i] = static_cast<LabelId>(i);
  return labels;
}

SegmentationConfig checked_network(SegmentationConfig config) {
  config = checked(config);
  if (config.channels == 2) throw ConfigError("segmentation.channels = 2 is neither 1 nor 3\n");
  return config;
}

// A network's output as one plane of scores per class, or a single plane of class numbers.
struct Planes {
  int count = 0, height = 0, width = 0;
  const float* values = nullptr;
};

std::optional<Planes> planes_of(const cv::Mat& output) {
  const bool has_channels = output.dims == 4;
  if (output.depth() != CV_32F || !output.isContinuous() || (!has_channels && output.dims != 3) ||
      output.size[0] != 1)
    return std::nullopt;
  Planes planes;
  planes.count = has_channels ? output.size[1] : 1;
  planes.height = output.size[output.dims - 2];
  planes.width = output.size[output.dims - 1];
  planes.values = output.ptr<float>();
  const bool usable = planes.count >= 1 && planes.height >= 1 && planes.width >= 1;
  return usable ? std::optional(planes) : std::nullopt;
}

// Class of every pixel of the output: the number in the plane, or the plane with the best score.
std::vector<float> classes_of(const Planes& planes) {
  const auto size =
      static_cast<std::size_t>(planes.height) * static_cast<std::size_t>(planes.width);
  std::vector<float> best(planes.values, planes.values + size);
  if (planes.count == 1) return best;
  std::vector<float> classes(size, 0.0F);
  for (int k = 1; k < planes.count; ++k) {
    const float* scores = planes.values + static_cast<std::size_t>(k) * size;
    for (std::size_t i = 0; i < size; ++i) {
      if (!(scores[i] > best[i])) continue;
      best[i] = scores[i];
      classes[i] = static_cast<float>(k);
    }
  }
  return classes;
}

}  // namespace

struct SegmentationNetwork::State {
  explicit State(const SegmentationConfig& settings)
      : config(checked_network(settings)),
        labels(labels_of(config)),
        network(config.network, kKey) {}

  cv::Mat run(const GrayImage& image) {
    cv::Mat input;
    cv::resize(view(image), input, {config.width_px, config.height_px}, 0.0, 0.0,
               image.width > config.width_px ? cv::INTER_AREA : cv::INTER_LINEAR);
    if (config.channels == 3) cv::cvtColor(input, input, cv::COLOR_GRAY2BGR);
    return network.run(
        cv::dnn::blobFromImage(input, config.scale, {}, cv::Scalar::all(config.mean)));
  }

  [[nodiscard]] std::optional<LabelId> label_of(float value) const {
    const auto index = static_cast<std::int64_t>(std::lround(value));
    if (!(value >= 0.0F) || index >= static_cast<std::int64_t>(kClasses)) return std::nullopt;
    return labels[static_cast<std::size_t>(index)];
  }

  SegmentationConfig config;
  std::array<std::optional<LabelId>, kClasses> labels;  // label of each class of the network
  ConfiguredNetwork network;
};

SegmentationNetwork::SegmentationNetwork(const SegmentationConfig& config)
    : state_(std::make_unique<State>(config)) {
  const auto& c = state_->config;
  const auto size = static_cast<std::size_t>(c.width_px) * static_cast<std::size_t>(c.height_px);
  try {
    const cv::Mat output = state_->run({c.width_px, c.height_px, std::vector<std::uint8_t>(size)});
    if (!planes_of(output))
      state_->network.refuse("its output is " +
                             shape_text({output.size.p, static_cast<std::size_t>(output.dims)}) +
                             ", not 1 x classes x height x width");
  } catch (const cv::Exception& error) {
    state_->network.refuse("does not run on an image of " + std::to_string(c.width_px) + " x " +
                           std::to_string(c.height_px) + " px with " + std::to_string(c.channels) +
                           " channels: " + reason_of(error));
  }
}

SegmentationNetwork::~SegmentationNetwork() = default;
SegmentationNetwork::SegmentationNetwork(SegmentationNetwork&&) noexcept = default;
SegmentationNetwork& SegmentationNetwork::operator=(SegmentationNetwork&&) noexcept = default;

Segmentation SegmentationNetwork::segment(const GrayImage& image) {
  const cv::Mat output = state_->run(image);
  const Planes planes = planes_of(output).value();
  const std::vector<float> classes = classes_of(planes);
  std::vector<std::optional<LabelId>> labels;
  for (const float value : classes) labels.push_back(state_->label_of(value));
  Segmentation result{{image.width, image.height, {}}, 0};
  result.labels.ids.reserve(image.pixels.size());
  for (int y = 0; y < image.height; ++y) {
    const int row = (2 * y + 1) * planes.height / (2 * image.height);
    for (int x = 0; x < image.width; ++x) {
      const int column = (2 * x + 1) * planes.width / (2 * image.width);
      const auto& label = labels[static_cast<std::size_t>(row * planes.width + column)];
      result.labels.ids.push_back(label.value_or(0));
      result.unmapped_pixels += label ? 0 : 1;
    }
  }
  return result;
}

}  // namespace km
