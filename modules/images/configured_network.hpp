#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/dnn.hpp>
#include <span>
#include <string>

namespace km {

/// The place of a network in the configuration, for messages.
struct NetworkKey {
  const char* key;      ///< "keyframe_features.network"
  const char* way_out;  ///< Remedy for a file that cannot be used, in the imperative.
};

/// A network in ONNX format whose file the configuration names. It is run by OpenCV's dnn module on
/// the processor. Not thread-safe.
class ConfiguredNetwork {
 public:
  /// Throws ConfigError that names the key, the file and the reason if it cannot be read.
  ConfiguredNetwork(std::filesystem::path file, const NetworkKey& key);

  /// Throws ConfigError with `reason`, the key, the file, and the way out.
  [[noreturn]] void refuse(const std::string& reason) const;

  /// Identity of the network: 64-bit FNV-1a of the file, never 0.
  [[nodiscard]] std::uint64_t fingerprint() const { return fingerprint_; }

  /// Shape of the first input; a size that is not fixed is 0. Empty if the file states none.
  [[nodiscard]] const cv::dnn::MatShape& input_shape() const { return input_; }

  /// The first output for `blob`. Throws cv::Exception if the network does not take it.
  [[nodiscard]] cv::Mat run(const cv::Mat& blob);

 private:
  std::filesystem::path file_;
  NetworkKey key_;
  std::uint64_t fingerprint_;
  cv::dnn::Net net_;
  cv::dnn::MatShape input_;
};

/// The reason of `error` without its place in OpenCV's sources.
[[nodiscard]] std::string reason_of(const cv::Exception& error);

/// "1 x 3 x 120 x 160"; "unknown" without sizes.
[[nodiscard]] std::string shape_text(std::span<const int> sizes);

}  // namespace km
