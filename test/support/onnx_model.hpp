#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace km {

/// Bytes of a protobuf message, field by field (developers.google.com/protocol-buffers: encoding).
class ProtobufBytes {
 public:
  ProtobufBytes& number(int field, std::uint64_t value) {
    varint(static_cast<std::uint64_t>(field) << 3U);
    varint(value);
    return *this;
  }
  ProtobufBytes& bytes(int field, std::string_view value) {
    varint(static_cast<std::uint64_t>(field) << 3U | 2U);
    varint(value.size());
    text_ += value;
    return *this;
  }
  ProtobufBytes& message(int field, const ProtobufBytes& value) {
    return bytes(field, value.text_);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7U) text_ += static_cast<char>((value & 0x7FU) | 0x80U);
    text_ += static_cast<char>(value);
  }
  std::string text_;
};

/// One layer: score of class k = sum over channels of weights[k][channel] * input + biases[k], at
/// every `stride`th pixel, as an ONNX file (onnx.proto, operator set 11).
struct PointwiseNetwork {
  int channels = 1, height = 8, width = 16, stride = 1;
  std::vector<std::vector<float>> weights = {};  ///< By class.
  std::vector<float> biases = {};

  [[nodiscard]] std::string onnx() const {
    const auto classes = static_cast<std::uint64_t>(weights.size());
    std::vector<float> flat;
    for (const auto& row : weights) flat.insert(flat.end(), row.begin(), row.end());
    ProtobufBytes node;
    node.bytes(1, "image").bytes(1, "weights").bytes(1, "biases").bytes(2, "scores");
    node.bytes(3, "layer").bytes(4, "Conv");
    node.message(5, integers("kernel_shape", {1, 1}));
    node.message(5, integers("strides", {stride, stride}));
    ProtobufBytes graph;
    graph.message(1, node).bytes(2, "test");
    graph.message(5,
                  tensor("weights", {classes, static_cast<std::uint64_t>(channels), 1, 1}, flat));
    graph.message(5, tensor("biases", {classes}, biases));
    graph.message(11, image("image", channels, height, width));
    graph.message(12, image("scores", static_cast<int>(classes), height / stride, width / stride));
    ProtobufBytes version;
    version.bytes(1, "").number(2, 11);
    return ProtobufBytes().number(1, 6).message(7, graph).message(8, version).text();
  }

 private:
  static ProtobufBytes integers(std::string_view name, const std::vector<int>& values) {
    constexpr int kIntegers = 7;  // AttributeProto::INTS
    ProtobufBytes attribute;
    attribute.bytes(1, name);
    for (const int value : values) attribute.number(8, static_cast<std::uint64_t>(value));
    return attribute.number(20, kIntegers);
  }
  static ProtobufBytes tensor(std::string_view name, const std::vector<std::uint64_t>& sizes,
                              const std::vector<float>& values) {
    constexpr int kFloat = 1;  // TensorProto::FLOAT
    ProtobufBytes tensor;
    for (const std::uint64_t size : sizes) tensor.number(1, size);
    tensor.number(2, kFloat).bytes(8, name);
    std::string raw;
    for (const float value : values)
      for (int byte = 0; byte < 4; ++byte)
        raw += static_cast<char>(std::bit_cast<std::uint32_t>(value) >> (8 * byte) & 0xFFU);
    return tensor.bytes(9, raw);
  }
  static ProtobufBytes image(std::string_view name, int channels, int height, int width) {
    ProtobufBytes shape;
    for (const int size : {1, channels, height, width})
      shape.message(1, ProtobufBytes().number(1, static_cast<std::uint64_t>(size)));
    const auto type = ProtobufBytes().message(1, ProtobufBytes().number(1, 1).message(2, shape));
    return ProtobufBytes().bytes(1, name).message(2, type);
  }
};

}  // namespace km
