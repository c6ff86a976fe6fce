// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <iomanip>
#include <string>

#include "services/bench/emulation/autopilot.hpp"
#include "services/command_line/exit_code.hpp"

namespace backwash::bench {

/// The truth and the estimate, a row every 20 ms, with the flight log's column names.
class TruthLog {
 public:
  explicit TruthLog(const std::string& path) : file_(path) {
    if (!path.empty() && !file_)
      throw StartError(kCannotCreate,
                       "--log " + path + ": cannot be created; name a file in a folder that can be written");
    file_ << "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,qw,qx,qy,qz,thrust,vio_x_m,vio_y_m,vio_z_m,"
             "armed,landed\n"
          << std::setprecision(15);
  }
  void row(double t, const Autopilot& a, const State& vio) {
    const auto vec = [&](const Vec3& v) { file_ << ',' << v.x() << ',' << v.y() << ',' << v.z(); };
    const auto q = a.attitude();
    file_ << t;
    vec(a.truth().p_W);
    vec(a.truth().v_W);
    vec(a.acceleration());
    file_ << ',' << q.w() << ',' << q.x() << ',' << q.y() << ',' << q.z() << ',' << a.thrust();
    vec(vio.p_W);
    file_ << ',' << a.armed() << ',' << a.landed() << '\n';
  }

 private:
  std::ofstream file_;
};

}  // namespace backwash::bench
