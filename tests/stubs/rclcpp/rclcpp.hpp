// A stub of the part of rclcpp that the printed node asks for: what compiles against it was never run in ROS 2.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <string>

namespace rclcpp {
struct Duration {
    double seconds() const { return 0.0; }
};
struct Time {
    Duration operator-(const Time &) const { return {}; }
};
struct QoS {
    QoS(int) {}
};
struct SensorDataQoS : QoS {
    SensorDataQoS() : QoS(5) {}
};
struct TimerBase {
    using SharedPtr = std::shared_ptr<TimerBase>;
};
template <class Message>
struct Subscription {
    using SharedPtr = std::shared_ptr<Subscription>;
};
namespace node_interfaces {
struct NodeBaseInterface {
    using SharedPtr = std::shared_ptr<NodeBaseInterface>;
};
}  // namespace node_interfaces
inline void init(int, char **) {}
inline void spin(node_interfaces::NodeBaseInterface::SharedPtr) {}
inline bool shutdown() { return true; }
}  // namespace rclcpp
