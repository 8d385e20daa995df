#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "apps/viewer/view_store.hpp"
#include "modules/core/ids.hpp"

namespace km {

struct PageServerOptions {
  std::string address = "127.0.0.1";  ///< To listen on; other than loopback, URLs need the token.
  int port = 8777;                    ///< 0: any that is free.
  std::string page_folder;            ///< Files of the page; empty: those in the program.
  std::string greeting;               ///< See page_greeting().
  /// Called when other robots than before are those whose images any page wants; in order, by one
  /// thread at a time.
  std::function<void(const std::set<RobotId>&)> on_images;
};

/// Serves the page and, on its WebSocket, all that is in a store and comes into it. Pages of other
/// sites get nothing: their Origin, or the Host that they reached this by, is another one.
class PageServer {
 public:
  /// `store` outlives this. Throws std::runtime_error that names address and port if nothing can
  /// listen there.
  PageServer(ViewStore& store, PageServerOptions options);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// What to open in a browser, with the token if there is one.
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
  std::string url_;
};

}  // namespace km
