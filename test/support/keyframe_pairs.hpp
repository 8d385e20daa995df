#pragma once

#include <filesystem>
#include <utility>
#include <vector>

#include "modules/sensors/folder_layouts.hpp"
#include "modules/sensors/text_file.hpp"

namespace km {

/// The stereo pairs of a folder of keyframes: rows `stamp [ns], left file, right file` of its
/// pairs.csv.
inline std::vector<StereoPairFile> list_keyframe_pairs(const std::filesystem::path& folder,
                                                       ReaderReport& report) {
  using Files = std::pair<std::filesystem::path, std::filesystem::path>;
  const auto files_of = [&](const TextRow& row) -> std::variant<Files, RowFault> {
    return Files(folder / row.fields[1], folder / row.fields[2]);
  };
  std::vector<StereoPairFile> pairs;
  for (const auto& [stamp, line, index, files] :
       read_ordered_rows<Files>(folder / "pairs.csv", 3, "lists no stereo pair", report, files_of))
    pairs.push_back({stamp, files.first, files.second, line, {}, {}});
  return pairs;
}

}  // namespace km
