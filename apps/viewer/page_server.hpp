#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "apps/viewer/view_store.hpp"
#include "modules/core/ids.hpp"

namespace km {

struct PageServerOptions {
  std::string address =
      "127.0.0.1";          ///< Address to listen on; if not loopback, URLs need the token.
  int port = 8777;          ///< Port to listen on; 0: any free port.
  std::string page_folder;  ///< Files of the page; empty: those embedded in the program.
  std::string hello;        ///< See hello_message().
  /// Called when the set of robots whose images some page requests has changed; in order, by one
  /// thread at a time.
  std::function<void(const std::set<RobotId>&)> on_images;
};

/// Serves the page, and on its WebSocket all present and future messages of a store. Refuses
/// requests whose Origin is another site and, without a token, requests under another host name.
class PageServer {
 public:
  /// `store` outlives this. Throws std::runtime_error that names address and port if they cannot be
  /// used.
  PageServer(ViewStore& store, PageServerOptions options);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// Address to open in a browser, with the token if there is one.
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
  std::string url_;
};

}  // namespace km
