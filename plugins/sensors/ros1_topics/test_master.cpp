// The address of the ROS master.
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "master.hpp"
#include "message_of.hpp"

namespace viwo::ros1 {
namespace {

TEST(MasterAddress, IsReadFromTheUri) {
  const MasterAddress master = master_address("http://robot-7.local:11311/");
  EXPECT_EQ(master.host, "robot-7.local");
  EXPECT_EQ(master.port, 11311);
  for (const char* wrong : {"robot:11311", "http://robot", "http://robot:0", "http://robot:99999",
                            "http://:11311", "https://robot:11311"}) {
    EXPECT_EQ(testing::error_of([&] { master_address(wrong); }),
              "master_uri is '" + std::string(wrong) + "': expected http://HOST:PORT");
  }
}

TEST(MasterAddress, ComesFromTheEnvironmentWhereNoneIsGiven) {
  setenv("ROS_MASTER_URI", "http://127.0.0.1:4711", 1);
  EXPECT_EQ(master_address("").port, 4711);
  EXPECT_EQ(master_address("http://127.0.0.1:4712").port, 4712);
  unsetenv("ROS_MASTER_URI");
  EXPECT_EQ(master_address("").uri, "http://localhost:11311");
}

}  // namespace
}  // namespace viwo::ros1
