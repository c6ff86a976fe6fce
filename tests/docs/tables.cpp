// SPDX-License-Identifier: BSD-3-Clause
// Prints the tables of docs/interfaces.md that are declared in core: a line `== NAME`, then rows of Markdown.
#include <iostream>

#include "core/config/odometry_profile.hpp"
#include "core/config/strict_table.hpp"

int main() {
  using namespace backwash::config;
  std::cout << "== Vehicle file\n" << vehicle_file_keys() << "== Model file\n" << model_file_keys();
  std::cout << "== Daemon file\n" << daemon_file_keys();
  std::cout << "== profiles\n";
  for (const OdometryProfile& p : odometry_profiles()) {
    const std::string_view child = p.child.empty() ? "frames.body" : p.child;
    std::cout << "| `" << p.name << "` | `" << p.frame << "` | `" << child << "` | `" << name(p.twist) << "` | "
              << p.rate_least << " |\n";
  }
  return std::cout.good() ? 0 : 1;
}
