#include "modules/images/configured_network.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "modules/core/config.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/core/io/input_file.hpp"

namespace km {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kMaxNetworkBytes = 1U << 30U;

// The values of field `wanted` of a protobuf message (protobuf.dev: encoding). A number is its
// value and has no bytes; a message or text is its bytes. Ends at the first byte that is none of
// these.
std::vector<std::pair<std::uint64_t, Bytes>> values_of(Bytes message, std::uint64_t wanted) {
  constexpr std::uint64_t kVarint = 0, k64Bits = 1, kBytes = 2, k32Bits = 5;  // wire types
  std::vector<std::pair<std::uint64_t, Bytes>> values;
  ByteReader in(message);
  while (in.left() > 0) {
    const std::uint64_t tag = in.varint();
    const std::uint64_t kind = tag & 7U;
    const std::uint64_t number = kind == kVarint || kind == kBytes ? in.varint() : 0;
    const std::uint64_t size = kind == kBytes    ? number
                               : kind == k64Bits ? 8
                               : kind == k32Bits ? 4
                                                 : 0;
    const Bytes bytes = in.bytes(size);
    if (in.failed() || kind == 3 || kind == 4 || kind > k32Bits) return {};
    if (tag >> 3U == wanted) values.emplace_back(number, bytes);
  }
  return values;
}

// Shape of the first input of an ONNX file (onnx.proto), which OpenCV reads but does not state.
// Empty if there is none; a size that is not fixed is 0.
cv::dnn::MatShape shape_of_input(Bytes model) {
  constexpr std::array<std::uint64_t, 5> kPath = {7, 11, 2, 1,
                                                  2};  // graph, input, type, tensor, shape
  for (const std::uint64_t field : kPath) {
    const auto values = values_of(model, field);
    if (values.empty()) return {};
    model = values.front().second;
  }
  cv::dnn::MatShape shape;
  for (const auto& [number, dimension] : values_of(model, 1)) {
    const auto size = values_of(dimension, 1);
    shape.push_back(size.empty() ? 0
                                 : static_cast<int>(std::min<std::uint64_t>(
                                       size.front().first, std::numeric_limits<int>::max())));
  }
  return shape;
}

std::string read_network(const std::filesystem::path& file, const NetworkKey& key) {
  try {
    return read_input_file(file, kMaxNetworkBytes);
  } catch (const std::runtime_error& error) {
    throw ConfigError(std::string(key.key) + ": " + error.what() + "; " + key.way_out);
  }
}

}  // namespace

ConfiguredNetwork::ConfiguredNetwork(std::filesystem::path file, const NetworkKey& key)
    : file_(std::move(file)), key_(key), fingerprint_(kFnv1aBasis) {
  const std::string bytes = read_network(file_, key_);
  const Bytes model(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  mix_fnv1a(fingerprint_, model);
  fingerprint_ = std::max<std::uint64_t>(fingerprint_, 1);
  try {
    net_ = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
  } catch (const cv::Exception& error) {
    refuse("cannot be run as ONNX: " + reason_of(error));
  }
  net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  input_ = shape_of_input(model);
}

void ConfiguredNetwork::refuse(const std::string& reason) const {
  throw ConfigError(std::string(key_.key) + ": " + file_.string() + ": " + reason + "; " +
                    key_.way_out);
}

cv::Mat ConfiguredNetwork::run(const cv::Mat& blob) {
  net_.setInput(blob);
  return net_.forward();
}

std::string reason_of(const cv::Exception& error) {
  std::string text = error.err.empty() ? error.what() : error.err;
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::string shape_text(std::span<const int> sizes) {
  std::string text;
  for (const int size : sizes) text += (text.empty() ? "" : " x ") + std::to_string(size);
  return text.empty() ? "unknown" : text;
}

}  // namespace km
