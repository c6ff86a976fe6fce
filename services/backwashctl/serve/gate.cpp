// SPDX-License-Identifier: BSD-3-Clause
#include "services/backwashctl/serve/gate.hpp"

#include <arpa/inet.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>

namespace backwash::ctl {
namespace {

bool is_ours(const std::string& host, int port) {
  const auto colon = host.rfind(':');
  const std::string name = host.substr(0, colon), digits = colon == std::string::npos ? "80" : host.substr(colon + 1);
  in_addr address{};
  return digits == std::to_string(port) && (name == "localhost" || inet_pton(AF_INET, name.c_str(), &address) == 1);
}

}  // namespace

Reply refusal(int status, const std::string& why) {
  const nlohmann::json told{{"error", why}};
  return {status, told.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

std::optional<Reply> refused(const Head& head, int port, const std::string& token) {
  if (head.method != "GET" && head.method != "POST") return refusal(405, "GET and POST are answered");
  if (head.parts) return refusal(400, "Range is not answered: ask for the whole");  // thousands of them fill the memory
  if (head.hosts != 1 || !is_ours(head.host, port))
    return refusal(403, "Host must be localhost or a numeric IPv4 address, with this port");
  if (!head.origin.empty() && head.origin != "http://" + head.host)
    return refusal(403, "Origin is another site's: open the page that is served here");
  if (!head.fetch_site.empty() && head.fetch_site != "same-origin" && head.fetch_site != "none")
    return refusal(403, "asked for by another site: open the page that is served here");
  if (head.method == "GET") return std::nullopt;
  if (!is_token(head.token, token)) return refusal(401, "read-only: open the page by the address that was printed");
  if (!head.content_encoding.empty() || !head.content_type.starts_with("application/json"))
    return refusal(415, "Content-Type must be application/json, without an encoding");
  return std::nullopt;
}

bool is_token(std::string_view said, const std::string& token) {
  unsigned differs = said.size() != token.size();
  for (std::size_t n = 0; n < token.size(); ++n)
    differs |= static_cast<unsigned>(n < said.size() ? said[n] : 0) ^ static_cast<unsigned>(token[n]);
  return differs == 0;
}

std::string draw_token() {
  std::random_device random;
  std::string token;
  for (int n = 0; n < 4; ++n) {
    char part[9];
    std::snprintf(part, sizeof part, "%08x", random());
    token += part;
  }
  return token;
}

}  // namespace backwash::ctl
