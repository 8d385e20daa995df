#include "modules/mesh/map_file.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <string_view>

#include "modules/core/bytes.hpp"
#include "modules/core/input_file.hpp"
#include "modules/core/write_file.hpp"

namespace km {
namespace {

constexpr std::string_view kMagic = "KMMAP1\n\n";
constexpr std::size_t kMaxElements = std::size_t{1} << 28U;

std::uint64_t check_sum_of(std::span<const std::uint8_t> bytes) {
  std::uint64_t sum = kFnv1aBasis;
  mix_fnv1a(sum, bytes);
  mix_fnv1a(sum, bytes.size());
  return sum;
}

// Calls `put` for each element of an array, after its length.
template <typename Array, typename Put>
void put_all(ByteWriter& out, const Array& array, const Put& put) {
  out.varint(array.size());
  for (const auto& element : array) put(element);
}

template <typename Array, typename Get>
void get_all(ByteReader& in, std::size_t bytes_each, Array& array, const Get& get) {
  array.resize(in.count(kMaxElements, bytes_each));
  for (auto& element : array) get(element);
}

std::vector<std::uint8_t> encode(const MapMesh& map) {
  ByteWriter out;
  out.f64(map.voxel_m);
  put_all(out, map.mesh.vertices, [&](const Eigen::Vector3f& v) {
    for (const float value : v) out.f32(value);
  });
  put_all(out, map.mesh.labels, [&](LabelId label) { out.u8(label); });
  put_all(out, map.mesh.colors, [&](const LabelledMesh::Color& color) { out.bytes(color); });
  put_all(out, map.mesh.faces, [&](const LabelledMesh::Face& face) {
    for (const std::uint32_t vertex : face) out.u32(vertex);
  });
  put_all(out, map.seen_by, [&](const auto& views) {
    for (const KeyframeIndex keyframe : views) out.u32(keyframe);
  });
  put_all(out, map.ids, [&](std::uint64_t id) { out.u64(id); });
  put_all(out, map.certainty, [&](std::uint8_t step) { out.u8(step); });
  return out.release();
}

MapMesh decode(ByteReader& in) {
  MapMesh map;
  map.voxel_m = in.f64();
  get_all(in, 12, map.mesh.vertices, [&](Eigen::Vector3f& v) {
    for (float& value : v) value = in.f32();
  });
  get_all(in, 1, map.mesh.labels, [&](LabelId& label) { label = in.u8(); });
  get_all(in, 3, map.mesh.colors, [&](LabelledMesh::Color& color) {
    for (std::uint8_t& value : color) value = in.u8();
  });
  get_all(in, 12, map.mesh.faces, [&](LabelledMesh::Face& face) {
    for (std::uint32_t& vertex : face) vertex = in.u32();
  });
  get_all(in, 8, map.seen_by, [&](auto& views) {
    for (KeyframeIndex& keyframe : views) keyframe = in.u32();
  });
  get_all(in, 8, map.ids, [&](std::uint64_t& id) { id = in.u64(); });
  get_all(in, 1, map.certainty, [&](std::uint8_t& step) { step = in.u8(); });
  return map;
}

bool is_usable(const MapMesh& map) {
  const std::size_t vertices = map.mesh.vertices.size();
  const auto fits = [vertices](std::size_t size) { return size == 0 || size == vertices; };
  return std::isfinite(map.voxel_m) && map.voxel_m >= 0.0 && map.seen_by.size() == vertices &&
         fits(map.mesh.labels.size()) && fits(map.mesh.colors.size()) && fits(map.ids.size()) &&
         fits(map.certainty.size()) &&
         std::ranges::all_of(map.mesh.vertices, [](const auto& v) { return v.allFinite(); }) &&
         std::ranges::all_of(map.mesh.faces,
                             [&](const auto& face) { return std::ranges::max(face) < vertices; }) &&
         std::ranges::adjacent_find(map.ids, std::greater_equal()) == map.ids.end();
}

}  // namespace

void write_map_file(const std::filesystem::path& file, const MapMesh& map) {
  const std::vector<std::uint8_t> content = encode(map);
  ByteWriter sum;
  sum.u64(check_sum_of(content));
  std::string bytes(kMagic);
  for (const auto& part : {sum.release(), content}) bytes.append(part.begin(), part.end());
  write_file(file, bytes, {.durable = true});
}

MapMesh read_map_file(const std::filesystem::path& file) {
  const std::string bytes = read_input_file(file);
  if (!bytes.starts_with(kMagic))
    throw InputFileError(file.string() + ": is no map of a robot's run");
  const std::span<const std::uint8_t> all(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                          bytes.size());
  ByteReader in(all.subspan(kMagic.size()));
  const std::uint64_t check_sum = in.u64();
  const bool whole = !in.failed() && check_sum_of(all.last(in.left())) == check_sum;
  MapMesh map = whole ? decode(in) : MapMesh();
  if (!whole || !in.done() || !is_usable(map))
    throw InputFileError(file.string() + ": is not whole");
  return map;
}

}  // namespace km
