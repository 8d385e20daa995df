#include "modules/mesh/map_file.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <string_view>

#include "modules/core/data/byte_archive.hpp"
#include "modules/core/io/input_file.hpp"
#include "modules/core/io/write_file.hpp"

namespace km {
namespace {

constexpr std::string_view kMagic = "KMMAP3\n\n";
constexpr std::size_t kMaxElements = std::size_t{1} << 28U;

std::uint64_t check_sum_of(std::span<const std::uint8_t> bytes) {
  std::uint64_t sum = kFnv1aBasis;
  mix_fnv1a(sum, bytes);
  mix_fnv1a(sum, bytes.size());
  return sum;
}

void describe(auto& archive, As<MapMesh> auto& map) {
  const auto numbers = [&](auto& list) {
    archive.list(list, kMaxElements, 1, [&](auto& element) { archive(element); });
  };
  const auto tuples = [&](auto& list) {
    archive.list(list, kMaxElements, 2, [&](auto& element) {
      for (auto& value : element) archive(value);
    });
  };
  archive(map.voxel_m);
  tuples(map.mesh.vertices);
  numbers(map.mesh.labels);
  tuples(map.mesh.colors);
  tuples(map.mesh.faces);
  tuples(map.seen_by);
  numbers(map.ids);
  numbers(map.certainty);
  numbers(map.levels);
}

}  // namespace

const char* fault_of(const MapMesh& map) {
  constexpr float kFarthest_m = 1e7F;
  const std::size_t vertices = map.mesh.vertices.size();
  const auto fits = [vertices](std::size_t size) { return size == 0 || size == vertices; };
  if (!std::isfinite(map.voxel_m) || map.voxel_m < 0.0) return "voxels have no size";
  if (map.seen_by.size() != vertices || !fits(map.mesh.labels.size()) ||
      !fits(map.mesh.colors.size()) || !fits(map.ids.size()) || !fits(map.certainty.size()) ||
      !fits(map.levels.size()))
    return "lists have other lengths than the vertices";
  for (const Eigen::Vector3f& v : map.mesh.vertices)
    if (!v.allFinite() || v.cwiseAbs().maxCoeff() >= kFarthest_m)
      return "a vertex is not finite or beyond 10,000 km";
  for (const auto& face : map.mesh.faces)
    if (std::ranges::max(face) >= vertices) return "a face names a vertex that does not exist";
  if (std::ranges::adjacent_find(map.ids, std::greater_equal()) != map.ids.end())
    return "ids do not ascend";
  return nullptr;
}

void write_map_file(const std::filesystem::path& file, const MapMesh& map) {
  ArchiveWriter archive;
  describe(archive, map);
  const std::vector<std::uint8_t> content = archive.release();
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
  const auto content = all.last(in.left());
  const bool whole = !in.failed() && check_sum_of(content) == check_sum;
  ArchiveReader archive(content);
  MapMesh map;
  if (whole) describe(archive, map);
  if (!whole || !archive.done() || fault_of(map) != nullptr)
    throw InputFileError(file.string() + ": is not whole");
  return map;
}

}  // namespace km
