#pragma once

#include <dds/dds.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace km {

/// A call into DDS that failed. what() names the call's purpose and DDS's reason.
struct DdsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Identity of a DDS participant on the network.
using Guid = std::array<std::uint8_t, 16>;

[[nodiscard]] inline Guid to_guid(const dds_guid_t& guid) {
  Guid result{};
  std::ranges::copy(guid.v, result.begin());
  return result;
}

/// Returns `result`, a handle or a count, or throws DdsError if it is an error code.
inline dds_return_t check_dds(dds_return_t result, const std::string& purpose) {
  if (result < 0) throw DdsError(purpose + ": " + dds_strretcode(result));
  return result;
}

/// Owns a DDS entity and its children, which DDS deletes with it.
class DdsEntity {
 public:
  DdsEntity() = default;
  /// Takes the result of a dds_create_* call. Throws DdsError if it is an error code.
  DdsEntity(dds_entity_t created, const std::string& purpose)
      : handle_(check_dds(created, "cannot create " + purpose)) {}
  ~DdsEntity() { reset(); }
  DdsEntity(DdsEntity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  DdsEntity& operator=(DdsEntity&& other) noexcept {
    if (this != &other) {
      reset();
      handle_ = std::exchange(other.handle_, 0);
    }
    return *this;
  }

  [[nodiscard]] dds_entity_t handle() const { return handle_; }
  void reset() noexcept {
    if (handle_ > 0) dds_delete(handle_);
    handle_ = 0;
  }

 private:
  dds_entity_t handle_ = 0;
};

/// The USER_DATA that a participant announces, untrusted bytes; empty: none.
[[nodiscard]] inline std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  std::string result(static_cast<const char*>(data), size);
  dds_free(data);
  return result;
}

struct DdsQosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using DdsQos = std::unique_ptr<dds_qos_t, DdsQosDeleter>;

inline DdsQos make_dds_qos() {
  return DdsQos(dds_create_qos());
}

}  // namespace km
