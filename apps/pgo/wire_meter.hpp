#pragma once

#include "modules/pose_graph/team/round_meter.hpp"

namespace km {

/// Measures CPU time of the calling thread, and messages by what DDS's serializer makes of them.
[[nodiscard]] TeamMeter wire_meter();

}  // namespace km
