#pragma once

namespace km {

/// Method by which MaxClique searches for a larger clique after a vertex was added.
enum class CliqueMethod {
  kExact,        ///< Branch and bound among the new vertex's neighbours, up to a limit.
  kIncremental,  ///< Greedy from the new vertex (Chang et al., "Kimera-Multi", ICRA 2021).
  kBatch,        ///< Greedy from every vertex, from scratch (Pattabiraman et al.).
};

}  // namespace km
