#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "modules/core/data/pose_graph.hpp"
#include "modules/outlier_rejection/bit_graph.hpp"

namespace km {

/// A closure with a label: true or false.
struct LabelledClosure {
  Closure closure;
  bool outlier = false;
};

/// State after the addition of one vertex. Times are CPU times of one thread.
struct PcmAddition {
  std::size_t vertices = 0;
  double check_s = 0.0;   ///< Consistency checks of the new closure against all others.
  double search_s = 0.0;  ///< Search for a larger clique.
  std::size_t clique = 0;
  std::size_t true_members = 0;   ///< True closures in the clique.
  std::size_t true_vertices = 0;  ///< True closures in the graph.
  std::size_t bound = 0;          ///< Proven upper bound of the clique size.
};

struct PcmRun {
  std::string search;  ///< Name from kSearches.
  std::vector<PcmAddition> additions;
  std::size_t dropped_true = 0, dropped_false = 0;  ///< Closures that contradict odometry.
  std::size_t edges = 0;                            ///< Edges of the consistency graph.
  std::uint64_t search_nodes = 0;
  std::size_t searches_ended = 0;  ///< Searches that reached MaxClique::kMaxSearchNodes.
};

/// A large clique of a graph that grows by one vertex at a time, by the heuristics with which the
/// paper compares. One is greedy_extension() from the new vertex (Chang et al., "Kimera-Multi",
/// ICRA 2021). The other starts from every vertex, from scratch (Pattabiraman et al., "Fast
/// Algorithms for the Maximum Clique Problem on Massive Graphs", Internet Mathematics 2015). The
/// older of equally large cliques is kept. Deterministic. Not thread-safe.
class GreedyClique {
 public:
  enum class Starts { kNewVertex, kAllVertices };
  explicit GreedyClique(Starts starts) : starts_(starts) {}

  /// Adds vertex number size(), with edges to the `neighbours`. Precondition: they are distinct and
  /// below size().
  void add(std::span<const std::size_t> neighbours);

  [[nodiscard]] std::size_t size() const { return graph_.size(); }
  /// The largest clique found, ascending.
  [[nodiscard]] std::span<const std::size_t> clique() const { return clique_; }
  /// No clique of the graph is larger than this, by its degrees.
  [[nodiscard]] std::size_t bound() const { return bound_; }

 private:
  Starts starts_;
  BitGraph graph_;
  std::vector<std::size_t> clique_;
  std::size_t bound_ = 0;
};

/// Methods by which a larger clique is searched after a vertex was added: MaxClique, GreedyClique
/// from the new vertex, and GreedyClique from every vertex.
inline const std::vector<std::string> kSearches = {"exact", "incremental", "batch"};

/// Called before every addition with the number of closures handled so far.
using PcmProgress = std::function<void(std::size_t)>;

/// Adds the closures one at a time, as Pcm does. All are inside one robot; those that contradict
/// the odometry between their ends are dropped. `search` is a name from kSearches. Throws
/// std::invalid_argument for a closure that is not is_usable().
[[nodiscard]] PcmRun run_pcm(const std::vector<LabelledClosure>& closures,
                             const std::string& search = "exact", const PcmProgress& progress = {});

/// Selection of the closures of a pose graph, and additional random ones.
struct ClosureChoice {
  std::size_t outliers = 0;  ///< Number of random closures to add.
  std::size_t keep = 0;      ///< Number of the file's closures to use, drawn at random; 0: all.
  unsigned seed = 1;
};

/// Result of read_closures().
struct [[nodiscard]] ClosureInput {
  std::vector<LabelledClosure> closures;
  std::size_t indefinite_edges = 0;  ///< Number in the file, odometry included, see G2oGraph.
};

/// Reads the closures of one robot's g2o file (2D or 3D) as true ones. Random outliers are added
/// with the covariance of the file's first closure, and the order of all is random. Throws
/// std::runtime_error "file[:line]: what" if the file is not one robot's pose graph with closures,
/// or has fewer closures than `selection` keeps.
[[nodiscard]] ClosureInput read_closures(const std::filesystem::path& file,
                                         const ClosureChoice& selection);

}  // namespace km
