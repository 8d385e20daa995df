#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "modules/outlier_rejection/pcm_config.hpp"

namespace km {

/// A closure of whom it is known whether it is true.
struct LabelledClosure {
  Closure closure;
  bool outlier = false;
};

/// A graph by the earlier neighbours of each vertex.
using ConsistencyRows = std::vector<std::vector<std::size_t>>;

/// State after one vertex was added. Times are those of the processor, of one thread.
struct PcmAddition {
  std::size_t vertices = 0;
  double check_s = 0.0;   ///< Consistency of the new closure with all others.
  double search_s = 0.0;  ///< Of the larger clique.
  std::size_t clique = 0;
  std::optional<std::size_t> true_members = {};   ///< Of the clique; nullopt without labels.
  std::optional<std::size_t> true_vertices = {};  ///< Of the graph; likewise.
  std::size_t bound = 0;                          ///< No clique is larger.
};

struct PcmRun {
  std::string search;  ///< "exact", "incremental" or "batch".
  std::vector<PcmAddition> additions;
  std::size_t dropped_true = 0, dropped_false = 0;  ///< By the odometry gate, before the graph.
  std::size_t edges = 0;                            ///< Of the consistency graph.
  std::uint64_t search_nodes = 0;
  std::size_t searches_ended = 0;  ///< By PcmConfig::max_search_nodes.
};

/// Called before every addition with the number of closures handled so far.
using PcmProgress = std::function<void(std::size_t)>;

/// Adds the closures, all inside one robot, one at a time, as Pcm does. Throws
/// std::invalid_argument for a closure that is not is_usable().
[[nodiscard]] PcmRun run_pcm(const std::vector<LabelledClosure>& closures, const PcmConfig& config,
                             const PcmProgress& progress = {});

/// Adds the vertices of a consistency graph one at a time; nothing is checked.
[[nodiscard]] PcmRun run_pcm(const ConsistencyRows& rows, const PcmConfig& config,
                             const PcmProgress& progress = {});

/// "exact", "incremental" or "batch".
[[nodiscard]] std::string to_string(CliqueMethod method);

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
