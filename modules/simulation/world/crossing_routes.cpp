#include "modules/simulation/world/crossing_routes.hpp"

namespace km {

const std::array<std::vector<Crossing>, 4>& crossing_routes() {
  static const std::array<std::vector<Crossing>, 4> kRoutes = {{
      {{1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}, {0, 2}, {1, 2}},
      {{1, 2}, {1, 1}, {2, 1}, {2, 2}, {3, 2}, {3, 1}, {2, 1}, {2, 2}},
      {{2, 2}, {2, 1}, {2, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 0}, {1, 0}, {1, 1}, {1, 2}},
      {{3, 1}, {2, 1}, {2, 0}, {3, 0}, {3, 1}, {2, 1}, {2, 2}, {3, 2}},
  }};
  return kRoutes;
}

}  // namespace km
