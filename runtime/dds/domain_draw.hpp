#pragma once

namespace km {

/// Draws a DDS domain from [first, last] that no other process of this host has drawn or takes part
/// in. The domain stays taken until this process and all its children have ended: robots outlive a
/// team that is killed. Throws std::runtime_error if all are taken, and std::system_error if the
/// system gives no socket.
[[nodiscard]] unsigned draw_domain(unsigned first, unsigned last);

}  // namespace km
