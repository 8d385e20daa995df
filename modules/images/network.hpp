#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <span>
#include <string>

#include "modules/core/frame.hpp"

namespace km {

/// Largest size of a network's file.
inline constexpr std::size_t kMaxNetworkBytes = 1U << 30U;

/// The network of an ONNX file, to be run by OpenCV's dnn module on the processor. `model`: the
/// bytes of the file. Throws cv::Exception if they are none.
[[nodiscard]] cv::dnn::Net read_onnx(const std::string& model);

/// The reason of `error` without its place in OpenCV's sources.
[[nodiscard]] std::string reason_of(const cv::Exception& error);

/// "1 x 3 x 120 x 160"; "unknown" without sizes.
[[nodiscard]] std::string shape_text(std::span<const int> sizes);

/// `image` at the size of a network's input.
[[nodiscard]] cv::Mat resized(const GrayImage& image, cv::Size size);

}  // namespace km
