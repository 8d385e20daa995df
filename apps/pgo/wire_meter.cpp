#include "apps/pgo/wire_meter.hpp"

#include <ctime>
#include <stdexcept>

#include "modules/pose_graph/newton/newton_codec.hpp"
#include "modules/pose_graph/pose_graph_codec.hpp"
#include "modules/pose_graph/robust/gnc_codec.hpp"
#include "runtime/dds/serialized_size.hpp"

namespace km {
namespace {

double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <typename T>
std::size_t size_on_wire(const T& message) {
  if constexpr (requires { Codec<T>::descriptor(); }) {
    const auto encoded = Codec<T>::encode(message);
    return serialized_size(Codec<T>::descriptor(), &encoded.wire);
  } else {
    throw std::logic_error("wire_meter: a message without a codec");
  }
}

}  // namespace

TeamMeter wire_meter() {
  return {.cpu_s = thread_cpu_s, .bytes = [](const TeamMessage& message) {
            return std::visit([](const auto& content) { return size_on_wire(content); }, message);
          }};
}

}  // namespace km
