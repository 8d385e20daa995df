#include "modules/mesh/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <istream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "modules/core/config.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/text_rows.hpp"
#include "modules/core/io/write_file.hpp"
#include "modules/core/quantile.hpp"

namespace km {
namespace {

constexpr double kMaxCoordinate_m = 1e9;  // squares of floats stay finite
// Vertices or faces, far more than a team maps in a day. A file of 2 GB with a valid header would
// otherwise take 3 GB.
constexpr std::size_t kMostElements = 50'000'000;

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };

// Values of the body one by one, in any encoding.
class Body {
 public:
  Body(std::istream& stream, PlyFormat format) : stream_(stream), format_(format) {}

  // The next value, which has this type in binary files.
  template <typename T>
  double next() {
    return format_ == PlyFormat::kAscii ? ascii() : static_cast<double>(binary<T>());
  }

 private:
  double ascii() {
    std::string word;  // operator>> of a double refuses "nan"
    if (!(stream_ >> std::setw(kMaxWord) >> word))
      throw std::runtime_error("ends before its last element");
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (*end != '\0') throw std::runtime_error("'" + word.substr(0, 20) + "' is not a number");
    return value;
  }

  template <typename T>
  T binary() {
    std::array<char, sizeof(T)> bytes;
    if (!stream_.read(bytes.data(), sizeof(T)))
      throw std::runtime_error("ends before its last element");
    const bool little = format_ == PlyFormat::kLittleEndian;
    if (little != (std::endian::native == std::endian::little))
      std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }

  static constexpr int kMaxWord = 400;  // length of a number

  std::istream& stream_;
  PlyFormat format_;
};

using PlyType = double (Body::*)();  // reads a value of the type

struct PlyProperty {
  std::string name;
  PlyType type = nullptr;
  bool is_list = false;
  PlyType count_type = nullptr;  // type of the length of a list
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

PlyType type_of(const std::string& name) {
  static const std::map<std::string, PlyType> types = {
      {"char", &Body::next<std::int8_t>},     {"int8", &Body::next<std::int8_t>},
      {"uchar", &Body::next<std::uint8_t>},   {"uint8", &Body::next<std::uint8_t>},
      {"short", &Body::next<std::int16_t>},   {"int16", &Body::next<std::int16_t>},
      {"ushort", &Body::next<std::uint16_t>}, {"uint16", &Body::next<std::uint16_t>},
      {"int", &Body::next<std::int32_t>},     {"int32", &Body::next<std::int32_t>},
      {"uint", &Body::next<std::uint32_t>},   {"uint32", &Body::next<std::uint32_t>},
      {"float", &Body::next<float>},          {"float32", &Body::next<float>},
      {"double", &Body::next<double>},        {"float64", &Body::next<double>}};
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
    if (element.count > kMostElements)
      throw std::runtime_error(std::to_string(element.count) + " elements, at most " +
                               std::to_string(kMostElements) + " are read");
    header.elements.push_back(element);
  } else if (key == "property") {
    if (header.elements.empty()) throw std::runtime_error("property before any element");
    header.elements.back().properties.push_back(parse_property(words));
  } else if (!key.empty() && key != "comment" && key != "obj_info") {
    throw std::runtime_error("unknown keyword '" + key.substr(0, 20) + "'");
  }
  return true;
}

// Reads up to and including `end_header`. Throws std::runtime_error with the problem and the line.
PlyHeader read_ply_header(std::istream& stream) {
  PlyHeader header;
  bool has_format = false;
  std::array<char, 4096> buffer;
  for (int number = 1; stream.getline(buffer.data(), buffer.size()); ++number) {
    std::string line(buffer.data());
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

// One instance of an element. scalars: values of its properties by position, 0 for a list. list:
// its vertex indices; other lists are skipped.
struct Row {
  std::vector<double> scalars;
  std::vector<double> list;
};

void read_row(const PlyElement& element, Body& body, Row& row) {
  row.scalars.clear();
  for (const PlyProperty& property : element.properties) {
    if (!property.is_list) {
      row.scalars.push_back((body.*property.type)());
      continue;
    }
    const double count = (body.*property.count_type)();
    if (!(count >= 0 && count <= 1e6))
      throw std::runtime_error(element.name + " with a list of " + std::to_string(count));
    const bool wanted = property.name == "vertex_indices" || property.name == "vertex_index";
    if (wanted) row.list.clear();
    for (int i = 0; i < static_cast<int>(count); ++i) {
      const double value = (body.*property.type)();
      if (wanted) row.list.push_back(value);
    }
    row.scalars.push_back(0.0);
  }
}

// Position of a scalar property, or -1.
int find(const PlyElement& element, const char* name) {
  for (std::size_t i = 0; i < element.properties.size(); ++i)
    if (element.properties[i].name == name && !element.properties[i].is_list)
      return static_cast<int>(i);
  return -1;
}

std::uint8_t as_byte(double value, const char* what) {
  if (value >= 0 && value <= 255) return static_cast<std::uint8_t>(value);
  throw std::runtime_error(std::string(what) + " " + std::to_string(value) +
                           " is outside 0 to 255");
}

double value_of(const Row& row, int property) {
  return row.scalars[static_cast<std::size_t>(property)];
}

void read_vertices(const PlyElement& element, Body& body, LabelledMesh& mesh) {
  const int x = find(element, "x"), y = find(element, "y"), z = find(element, "z");
  const int red = find(element, "red"), green = find(element, "green"),
            blue = find(element, "blue"), label = find(element, "label");
  if (x < 0 || y < 0 || z < 0) throw std::runtime_error("vertices without x, y, z");
  Row row;
  for (std::size_t i = 0; i < element.count; ++i) {
    read_row(element, body, row);
    const Eigen::Vector3d point(value_of(row, x), value_of(row, y), value_of(row, z));
    if (!point.allFinite())
      throw std::runtime_error("vertex " + std::to_string(i) + " is not finite");
    if (point.cwiseAbs().maxCoeff() > kMaxCoordinate_m)
      throw std::runtime_error("vertex " + std::to_string(i) + " is beyond " +
                               shortest_text(kMaxCoordinate_m) + " m");
    mesh.vertices.push_back(point.cast<float>());
    if (red >= 0 && green >= 0 && blue >= 0)
      mesh.colors.push_back({as_byte(value_of(row, red), "red"),
                             as_byte(value_of(row, green), "green"),
                             as_byte(value_of(row, blue), "blue")});
    if (label >= 0) mesh.labels.push_back(as_byte(value_of(row, label), "label"));
  }
}

std::uint32_t as_index(double value, std::size_t face, std::size_t vertices) {
  if (value >= 0 && value < static_cast<double>(vertices)) return static_cast<std::uint32_t>(value);
  throw std::runtime_error("face " + std::to_string(face) + " names vertex " +
                           std::to_string(value) + " of " + std::to_string(vertices));
}

// Faces may precede the vertices: `vertices` is their number according to the header.
std::vector<LabelId> read_faces(const PlyElement& element, std::size_t vertices, Body& body,
                                std::vector<LabelledMesh::Face>& faces) {
  const int label = find(element, "label");
  std::vector<LabelId> labels;
  Row row;
  for (std::size_t i = 0; i < element.count; ++i) {
    read_row(element, body, row);
    if (row.list.size() < 3)
      throw std::runtime_error("face " + std::to_string(i) + " has fewer than 3 corners");
    std::vector<std::uint32_t> corners;
    for (const double index : row.list) corners.push_back(as_index(index, i, vertices));
    for (std::size_t k = 2; k < corners.size(); ++k) {
      faces.push_back({corners[0], corners[k - 1], corners[k]});
      if (label >= 0) labels.push_back(as_byte(value_of(row, label), "label"));
    }
  }
  return labels;
}

std::size_t vertex_count(const PlyHeader& header) {
  for (const PlyElement& element : header.elements)
    if (element.name == "vertex") return element.count;
  throw std::runtime_error("no element 'vertex'");
}

LabelledMesh read(std::istream& stream) {
  const PlyHeader header = read_ply_header(stream);
  Body body(stream, header.format);
  LabelledMesh mesh;
  std::vector<LabelId> face_labels;
  Row row;
  for (const PlyElement& element : header.elements) {
    if (element.properties.empty() && element.count > 0)
      throw std::runtime_error("element '" + element.name + "' without properties");
    if (element.name == "vertex") {
      read_vertices(element, body, mesh);
    } else if (element.name == "face") {
      face_labels = read_faces(element, vertex_count(header), body, mesh.faces);
    } else {
      for (std::size_t i = 0; i < element.count; ++i) read_row(element, body, row);
    }
  }
  if (mesh.vertices.size() != vertex_count(header)) throw std::runtime_error("vertices twice");
  if (mesh.labels.empty() && !face_labels.empty()) {
    mesh.labels.assign(mesh.vertices.size(), 0);
    for (std::size_t i = 0; i < face_labels.size(); ++i)
      for (const std::uint32_t corner : mesh.faces[i]) mesh.labels[corner] = face_labels[i];
  }
  return mesh;
}

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

template <typename T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string header(const LabelledMesh& mesh) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex ";
  text += std::to_string(mesh.vertices.size());
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
    text += std::string("\nproperty float ") + name;
  text += '\n';
  if (!mesh.colors.empty())
    text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  if (!mesh.labels.empty()) text += "property uchar label\n";
  text += "element face " + std::to_string(mesh.faces.size());
  text += "\nproperty list uchar uint vertex_indices\nend_header\n";
  return text;
}

std::string encode(const LabelledMesh& mesh) {
  std::string bytes = header(mesh);
  const std::vector<Eigen::Vector3f> normals = mesh.normals();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const Eigen::Vector3f& vector : {mesh.vertices[i], normals[i]})
      for (int axis = 0; axis < 3; ++axis) put(bytes, vector[axis]);
    if (!mesh.colors.empty()) put(bytes, mesh.colors[i]);
    if (!mesh.labels.empty()) put(bytes, mesh.labels[i]);
  }
  for (const auto& face : mesh.faces) {
    put(bytes, std::uint8_t{3});
    put(bytes, face);
  }
  return bytes;
}

}  // namespace

LabelledMesh read_mesh(const std::filesystem::path& file) {
  const std::string problem = problem_of_file(file);
  std::ifstream stream(file, std::ios::binary);
  if (!stream || !problem.empty())
    throw InputFileError(file.string() + ": cannot be opened" +
                         (problem.empty() ? "" : ": " + problem));
  try {
    return read(stream);
  } catch (const std::runtime_error& error) {
    throw InputFileError(file.string() + ": " + readable(error.what()));
  }
}

LabelledMesh without_far_vertices(LabelledMesh mesh, const std::string& name,
                                  std::vector<std::string>& notes) {
  constexpr float kFar = 100.0F;
  if (mesh.empty()) return mesh;
  std::vector<float> values(mesh.vertices.size());
  Eigen::Vector3f low, high;  // quartiles
  for (int axis = 0; axis < 3; ++axis) {
    std::ranges::transform(mesh.vertices, values.begin(), [&](const auto& v) { return v[axis]; });
    low[axis] = static_cast<float>(quantile(values, 0.25));
    high[axis] = static_cast<float>(quantile(values, 0.75));
  }
  const float bound_m = kFar * (high - low).norm();
  const Eigen::Vector3f middle = 0.5F * (low + high);
  std::vector<std::uint32_t> kept;
  for (std::uint32_t v = 0; v < values.size(); ++v)
    if (bound_m == 0.0F || (mesh.vertices[v] - middle).norm() <= bound_m) kept.push_back(v);
  if (kept.size() == values.size()) return mesh;
  const std::size_t faces = std::erase_if(mesh.faces, [&](const LabelledMesh::Face& face) {
    return !std::ranges::all_of(face, [&](auto v) { return std::ranges::binary_search(kept, v); });
  });
  mesh.keep_vertices(kept);
  notes.push_back(name + ": not shown: " + std::to_string(faces) + " faces with a vertex over " +
                  std::to_string(std::lround(bound_m)) + " m from the middle");
  return mesh;
}

void write_mesh(const std::filesystem::path& file, const LabelledMesh& mesh) {
  if (file.extension() != ".ply")
    throw std::invalid_argument(file.string() + ": the extension is not .ply");
  write_file(file, encode(mesh));
}

}  // namespace km
