#include "modules/mesh/ply_header.hpp"

#include <map>
#include <sstream>
#include <stdexcept>

namespace km {
namespace {

PlyType type_of(const std::string& name) {
  static const std::map<std::string, PlyType> types = {
      {"char", PlyType::kInt8},     {"int8", PlyType::kInt8},     {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},   {"short", PlyType::kInt16},   {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16}, {"uint16", PlyType::kUint16}, {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},   {"uint", PlyType::kUint32},   {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat},   {"float32", PlyType::kFloat}, {"double", PlyType::kDouble},
      {"float64", PlyType::kDouble}};
  const auto found = types.find(name);
  if (found == types.end()) throw std::runtime_error("unknown type '" + name + "'");
  return found->second;
}

PlyFormat format_of(const std::string& name) {
  if (name == "ascii") return PlyFormat::kAscii;
  if (name == "binary_little_endian") return PlyFormat::kLittleEndian;
  if (name == "binary_big_endian") return PlyFormat::kBigEndian;
  throw std::runtime_error("unknown format '" + name + "'");
}

PlyProperty parse_property(std::istringstream& words) {
  PlyProperty property;
  std::string type;
  words >> type;
  if (type == "list") {
    std::string count_type;
    words >> count_type >> type;
    property.is_list = true;
    property.count_type = type_of(count_type);
  }
  property.type = type_of(type);
  if (!(words >> property.name)) throw std::runtime_error("property without a name");
  return property;
}

// False at end_header.
bool parse_line(const std::string& line, PlyHeader& header, bool& has_format) {
  std::istringstream words(line);
  std::string key;
  words >> key;
  if (key == "end_header") return false;
  if (key == "format") {
    std::string format;
    words >> format;
    header.format = format_of(format);
    has_format = true;
  } else if (key == "element") {
    PlyElement element;
    if (!(words >> element.name >> element.count)) throw std::runtime_error("bad element");
    header.elements.push_back(element);
  } else if (key == "property") {
    if (header.elements.empty()) throw std::runtime_error("property before any element");
    header.elements.back().properties.push_back(parse_property(words));
  } else if (!key.empty() && key != "comment" && key != "obj_info") {
    throw std::runtime_error("unknown keyword '" + key.substr(0, 20) + "'");
  }
  return true;
}

}  // namespace

PlyHeader read_ply_header(std::istream& stream) {
  PlyHeader header;
  bool has_format = false;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (number == 1) {
      if (line != "ply") throw std::runtime_error("line 1: not a PLY file");
      continue;
    }
    try {
      if (parse_line(line, header, has_format)) continue;
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("line " + std::to_string(number) + ": " + error.what());
    }
    if (!has_format) throw std::runtime_error("header without a format line");
    return header;
  }
  throw std::runtime_error("header without end_header");
}

}  // namespace km
