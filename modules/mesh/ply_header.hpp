#pragma once

#include <cstddef>
#include <istream>
#include <string>
#include <vector>

namespace km {

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  ///< Of a list's length.
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
};

/// Reads up to and with `end_header`. Throws std::runtime_error with what is wrong and the line.
[[nodiscard]] PlyHeader read_ply_header(std::istream& stream);

}  // namespace km
