// A stub of the part of rclcpp_lifecycle that the printed node asks for: never run in ROS 2.
#pragma once
#include <vector>

#include "rclcpp/rclcpp.hpp"

namespace rclcpp_lifecycle {
struct State {};
namespace node_interfaces {
struct LifecycleNodeInterface {
    enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
};
}  // namespace node_interfaces
template <class Message>
struct LifecyclePublisher {
    using SharedPtr = std::shared_ptr<LifecyclePublisher>;
    void publish(const Message &) {}
};
struct Parameter {
    std::vector<double> as_double_array() const { return {}; }
};
class LifecycleNode {
public:
    using Answer = node_interfaces::LifecycleNodeInterface::CallbackReturn;
    explicit LifecycleNode(const std::string &) {}
    virtual ~LifecycleNode() = default;
    virtual Answer on_configure(const State &) { return Answer::SUCCESS; }
    virtual Answer on_activate(const State &) { return Answer::SUCCESS; }
    virtual Answer on_deactivate(const State &) { return Answer::SUCCESS; }
    template <class Value>
    void declare_parameter(const std::string &, const Value &) {}
    Parameter get_parameter(const std::string &) const { return {}; }
    template <class Message, class Callback>
    typename rclcpp::Subscription<Message>::SharedPtr create_subscription(const std::string &, const rclcpp::QoS &, Callback callback)
    {
        std::function<void(std::shared_ptr<const Message>)> kept = callback;
        return nullptr;
    }
    template <class Message>
    typename LifecyclePublisher<Message>::SharedPtr create_publisher(const std::string &, const rclcpp::QoS &) { return nullptr; }
    rclcpp::TimerBase::SharedPtr create_wall_timer(std::chrono::nanoseconds, std::function<void()>) { return nullptr; }
    rclcpp::Time now() const { return {}; }
    rclcpp::node_interfaces::NodeBaseInterface::SharedPtr get_node_base_interface() { return nullptr; }
};
}  // namespace rclcpp_lifecycle
