// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace backwash::ctl {

/// An answer to a browser.
struct Reply {
  int status = 200;
  std::string body, type = "application/json";
};

/// A refusal: {"error": why}.
Reply refusal(int status, const std::string& why);

/// What a request says of itself before its body is read. A header that is not there is empty.
struct Head {
  std::string method, host, origin, fetch_site, content_type, content_encoding, token;
  std::size_t hosts = 0;  ///< how many Host headers
  bool parts = false;     ///< asks for parts of the answer
};

/// Why a request is refused, or nothing. Whoever asks must have called us `localhost` or by a numeric IPv4 address,
/// with our port: a page of another site that has its own name point here (DNS rebinding) calls us by that name. A
/// browser must say that it asks for our own page. What changes something needs the token, as JSON.
std::optional<Reply> refused(const Head& head, int port, const std::string& token);

/// Whether that is the token, in a time that does not tell how much of it was right.
bool is_token(std::string_view said, const std::string& token);

/// 128 random bits in hexadecimal.
std::string draw_token();

}  // namespace backwash::ctl
