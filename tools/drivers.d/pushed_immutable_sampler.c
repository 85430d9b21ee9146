// lavapipe of Mesa 25.0.7 and 26.2.6 loses a sampler that is immutable in a set layout with the push-descriptor flag, if descriptors of another
// layout were pushed before: what those left at its place is used. Here that is another sampler; in a larger program it was a jump into
// data. With `a.out bound` the sampler is given with the descriptor, and the right colour is printed. Mesa 22.3.6 prints it both times.
//
//   gcc -o a.out pushed_immutable_sampler.c -lvulkan && ./a.out       right: 0.25 0.50 0.75 1.00; wrong: 0.00 0.00 0.00 0.00
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

#define CHECK(call) \
    if ((call) != VK_SUCCESS) return fprintf(stderr, "%s failed\n", #call), 1

// #version 450
// layout(set = 0, binding = 0) writeonly buffer Result { vec4 result; };
// layout(set = 0, binding = 1) uniform sampler2D image;
// void main() { result = textureLod(image, vec2(1.5), 0.0); }
static const uint32_t shader[] = {
    0x07230203, 0x00010300, 0x000d000b, 0x0000001d, 0x00000000, 0x00020011, 0x00000001, 0x0006000b, 0x00000001, 0x4c534c47, 0x6474732e, 0x3035342e,
    0x00000000, 0x0003000e, 0x00000000, 0x00000001, 0x0005000f, 0x00000005, 0x00000004, 0x6e69616d, 0x00000000, 0x00060010, 0x00000004, 0x00000011,
    0x00000001, 0x00000001, 0x00000001, 0x00040048, 0x00000008, 0x00000000, 0x00000019, 0x00050048, 0x00000008, 0x00000000, 0x00000023, 0x00000000,
    0x00030047, 0x00000008, 0x00000002, 0x00040047, 0x0000000a, 0x00000022, 0x00000000, 0x00040047, 0x0000000a, 0x00000021, 0x00000000, 0x00040047,
    0x00000010, 0x00000022, 0x00000000, 0x00040047, 0x00000010, 0x00000021, 0x00000001, 0x00040047, 0x0000001c, 0x0000000b, 0x00000019, 0x00020013,
    0x00000002, 0x00030021, 0x00000003, 0x00000002, 0x00030016, 0x00000006, 0x00000020, 0x00040017, 0x00000007, 0x00000006, 0x00000004, 0x0003001e,
    0x00000008, 0x00000007, 0x00040020, 0x00000009, 0x0000000c, 0x00000008, 0x0004003b, 0x00000009, 0x0000000a, 0x0000000c, 0x00040015, 0x0000000b,
    0x00000020, 0x00000001, 0x0004002b, 0x0000000b, 0x0000000c, 0x00000000, 0x00090019, 0x0000000d, 0x00000006, 0x00000001, 0x00000000, 0x00000000,
    0x00000000, 0x00000001, 0x00000000, 0x0003001b, 0x0000000e, 0x0000000d, 0x00040020, 0x0000000f, 0x00000000, 0x0000000e, 0x0004003b, 0x0000000f,
    0x00000010, 0x00000000, 0x00040017, 0x00000012, 0x00000006, 0x00000002, 0x0004002b, 0x00000006, 0x00000013, 0x3fc00000, 0x0005002c, 0x00000012,
    0x00000014, 0x00000013, 0x00000013, 0x0004002b, 0x00000006, 0x00000015, 0x00000000, 0x00040020, 0x00000017, 0x0000000c, 0x00000007, 0x00040015,
    0x00000019, 0x00000020, 0x00000000, 0x00040017, 0x0000001a, 0x00000019, 0x00000003, 0x0004002b, 0x00000019, 0x0000001b, 0x00000001, 0x0006002c,
    0x0000001a, 0x0000001c, 0x0000001b, 0x0000001b, 0x0000001b, 0x00050036, 0x00000002, 0x00000004, 0x00000000, 0x00000003, 0x000200f8, 0x00000005,
    0x0004003d, 0x0000000e, 0x00000011, 0x00000010, 0x00070058, 0x00000007, 0x00000016, 0x00000011, 0x00000014, 0x00000002, 0x00000015, 0x00050041,
    0x00000017, 0x00000018, 0x0000000a, 0x0000000c, 0x0003003e, 0x00000018, 0x00000016, 0x000100fd, 0x00010038,
};

static uint32_t memory_type(VkPhysicalDevice physical, uint32_t bits, VkMemoryPropertyFlags wanted) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    for (uint32_t i = 0; i < memory.memoryTypeCount; i++)
        if (bits >> i & 1 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
    return 0;
}

int main(int count, char **arguments) {
    int is_bound = count > 1 && !strcmp(arguments[1], "bound");
    VkApplicationInfo application = {VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_1};
    VkInstance instance;
    CHECK(vkCreateInstance(&(VkInstanceCreateInfo){VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &application}, NULL, &instance));
    uint32_t devices = 1;
    VkPhysicalDevice physical;
    if (vkEnumeratePhysicalDevices(instance, &devices, &physical) < 0 || !devices) return fprintf(stderr, "no device\n"), 1;
    VkDeviceQueueCreateInfo queues = {VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueCount = 1, .pQueuePriorities = &(float){1}};
    const char *extensions[] = {"VK_KHR_push_descriptor"};
    VkDevice device;
    CHECK(vkCreateDevice(physical,
                         &(VkDeviceCreateInfo){VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .queueCreateInfoCount = 1, .pQueueCreateInfos = &queues,
                                               .enabledExtensionCount = 1, .ppEnabledExtensionNames = extensions},
                         NULL, &device));
    VkQueue queue;
    vkGetDeviceQueue(device, 0, 0, &queue);

    VkImage image;
    CHECK(vkCreateImage(device,
                        &(VkImageCreateInfo){VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO, .imageType = VK_IMAGE_TYPE_2D, .format = VK_FORMAT_R32G32B32A32_SFLOAT,
                                             .extent = {1, 1, 1}, .mipLevels = 1, .arrayLayers = 1, .samples = VK_SAMPLE_COUNT_1_BIT,
                                             .usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT},
                        NULL, &image));
    VkBuffer buffer;
    CHECK(vkCreateBuffer(device,
                         &(VkBufferCreateInfo){VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO, .size = 16, .usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT}, NULL,
                         &buffer));
    VkMemoryRequirements needs;
    VkDeviceMemory of_image, of_buffer;
    vkGetImageMemoryRequirements(device, image, &needs);
    VkMemoryAllocateInfo allocate = {VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs.size,
                                     .memoryTypeIndex = memory_type(physical, needs.memoryTypeBits, 0)};
    CHECK(vkAllocateMemory(device, &allocate, NULL, &of_image));
    CHECK(vkBindImageMemory(device, image, of_image, 0));
    vkGetBufferMemoryRequirements(device, buffer, &needs);
    allocate.allocationSize = needs.size;
    allocate.memoryTypeIndex =
        memory_type(physical, needs.memoryTypeBits, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    CHECK(vkAllocateMemory(device, &allocate, NULL, &of_buffer));
    CHECK(vkBindBufferMemory(device, buffer, of_buffer, 0));
    VkImageSubresourceRange whole = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageView view;
    CHECK(vkCreateImageView(device,
                            &(VkImageViewCreateInfo){VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO, .image = image, .viewType = VK_IMAGE_VIEW_TYPE_2D,
                                                     .format = VK_FORMAT_R32G32B32A32_SFLOAT, .subresourceRange = whole},
                            NULL, &view));
    // Outside the image one gives its colour and the other black.
    VkSampler sampler, other_sampler;
    VkSamplerCreateInfo inside = {VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO, .addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE,
                                  .addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE};
    VkSamplerCreateInfo outside = {VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO, .addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER,
                                   .addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_BORDER};
    CHECK(vkCreateSampler(device, &inside, NULL, &sampler));
    CHECK(vkCreateSampler(device, &outside, NULL, &other_sampler));

    VkDescriptorSetLayoutBinding bindings[] = {
        {0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, NULL},
        {1, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, VK_SHADER_STAGE_COMPUTE_BIT, is_bound ? NULL : &sampler},
    };
    VkDescriptorSetLayoutBinding others[] = {bindings[0], {1, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, VK_SHADER_STAGE_COMPUTE_BIT, NULL}};
    VkDescriptorSetLayout set, other_set;
    VkPipelineLayout layout, other_layout;
    for (int is_other = 0; is_other < 2; is_other++) {
        VkDescriptorSetLayoutCreateInfo create = {VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
                                                  .flags = VK_DESCRIPTOR_SET_LAYOUT_CREATE_PUSH_DESCRIPTOR_BIT_KHR, .bindingCount = 2,
                                                  .pBindings = is_other ? others : bindings};
        VkDescriptorSetLayout *made = is_other ? &other_set : &set;
        CHECK(vkCreateDescriptorSetLayout(device, &create, NULL, made));
        VkPipelineLayoutCreateInfo of_set = {VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO, .setLayoutCount = 1, .pSetLayouts = made};
        CHECK(vkCreatePipelineLayout(device, &of_set, NULL, is_other ? &other_layout : &layout));
    }
    VkShaderModule module;
    CHECK(vkCreateShaderModule(
        device, &(VkShaderModuleCreateInfo){VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO, .codeSize = sizeof shader, .pCode = shader}, NULL, &module));
    VkPipeline pipeline;
    VkComputePipelineCreateInfo compute = {
        VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = {VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, .stage = VK_SHADER_STAGE_COMPUTE_BIT, .module = module, .pName = "main"},
        .layout = layout,
    };
    CHECK(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &compute, NULL, &pipeline));

    VkCommandPool pool;
    CHECK(vkCreateCommandPool(device, &(VkCommandPoolCreateInfo){VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO}, NULL, &pool));
    VkCommandBuffer commands;
    CHECK(vkAllocateCommandBuffers(
        device, &(VkCommandBufferAllocateInfo){VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO, .commandPool = pool, .commandBufferCount = 1}, &commands));
    CHECK(vkBeginCommandBuffer(commands, &(VkCommandBufferBeginInfo){VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO}));
    VkImageMemoryBarrier barrier = {VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER, .dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                                    .newLayout = VK_IMAGE_LAYOUT_GENERAL, .image = image, .subresourceRange = whole};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 0, NULL, 0, NULL, 1, &barrier);
    vkCmdClearColorImage(commands, image, VK_IMAGE_LAYOUT_GENERAL, &(VkClearColorValue){{0.25f, 0.5f, 0.75f, 1}}, 1, &whole);
    barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT;
    barrier.oldLayout = VK_IMAGE_LAYOUT_GENERAL;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, 0, 0, NULL, 0, NULL, 1, &barrier);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    VkDescriptorImageInfo sampled = {is_bound ? sampler : VK_NULL_HANDLE, view, VK_IMAGE_LAYOUT_GENERAL};
    VkDescriptorBufferInfo stored = {buffer, 0, 16};
    VkWriteDescriptorSet writes[] = {
        {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, .dstBinding = 0, .descriptorCount = 1, .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER,
         .pBufferInfo = &stored},
        {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET, .dstBinding = 1, .descriptorCount = 1, .descriptorType = VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER,
         .pImageInfo = &sampled},
    };
    VkDescriptorImageInfo other_sampled = {other_sampler, view, VK_IMAGE_LAYOUT_GENERAL};
    VkWriteDescriptorSet other_writes[] = {writes[0], writes[1]};
    other_writes[1].pImageInfo = &other_sampled;
    PFN_vkCmdPushDescriptorSetKHR push = (PFN_vkCmdPushDescriptorSetKHR)vkGetDeviceProcAddr(device, "vkCmdPushDescriptorSetKHR");
    push(commands, VK_PIPELINE_BIND_POINT_COMPUTE, other_layout, 0, 2, other_writes);
    push(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 2, writes);
    vkCmdDispatch(commands, 1, 1, 1);
    CHECK(vkEndCommandBuffer(commands));
    CHECK(vkQueueSubmit(queue, 1, &(VkSubmitInfo){VK_STRUCTURE_TYPE_SUBMIT_INFO, .commandBufferCount = 1, .pCommandBuffers = &commands}, VK_NULL_HANDLE));
    CHECK(vkQueueWaitIdle(queue));
    float *colour;
    CHECK(vkMapMemory(device, of_buffer, 0, 16, 0, (void **)&colour));
    printf("%.2f %.2f %.2f %.2f\n", colour[0], colour[1], colour[2], colour[3]);
    return 0;
}
