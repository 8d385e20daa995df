#pragma once

#include <dds/dds.h>

#include <cstddef>
#include <string>

namespace km {

/// The USER_DATA that a participant announces, untrusted bytes; empty: none.
[[nodiscard]] inline std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  std::string result(static_cast<const char*>(data), size);
  dds_free(data);
  return result;
}

}  // namespace km
