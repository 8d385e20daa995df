#pragma once

#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/pgo/pcm_run.hpp"

namespace km {

/// What is done to the closures of a pose graph before they are added.
struct ClosureChoice {
  std::size_t outliers = 0;         ///< Random closures to add.
  double outlier_half_side_m = 20;  ///< Their translations, see RandomOutlierModel.
  std::size_t keep = 0;             ///< Of the file's closures, drawn at random; 0: all.
  bool shuffle = true;              ///< The order of all.
  unsigned seed = 1;
};

/// Pairs of keyframes, the lower index first.
using KeyframePairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

/// Reads rows "i j flag" with flag 1 for an outlier and 0 for a true closure: the pairs of the
/// outliers. Throws std::runtime_error "file:line: what".
[[nodiscard]] KeyframePairs read_outlier_labels(std::istream& in, const std::string& file);

/// What read_closures() finds.
struct [[nodiscard]] ClosureInput {
  std::vector<LabelledClosure> closures;
  std::size_t indefinite_edges = 0;  ///< Of the file, odometry included, see G2oGraph.
};

/// The closures of one robot's g2o file (2D or 3D), those of the pairs in `false_pairs` labelled,
/// and random outliers that claim the covariance of the file's first closure.
/// Throws std::runtime_error "file[:line]: what" for a file that is not one robot's pose graph with
/// closures, or has fewer of them than are to be kept.
[[nodiscard]] ClosureInput read_closures(const std::filesystem::path& file,
                                         const KeyframePairs& false_pairs,
                                         const ClosureChoice& selection);

/// Reads a consistency graph: the number of vertices, then one line per vertex with its earlier
/// neighbours, empty if it has none. Throws std::runtime_error "file:line: what".
[[nodiscard]] ConsistencyRows read_consistency_rows(std::istream& in, const std::string& file);

}  // namespace km
