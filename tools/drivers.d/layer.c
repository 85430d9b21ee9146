// VK_LAYER_ECHOLUME_faults: a Vulkan layer that counts what a program asks of a device, injects the failures of real devices, and completes
// the work of drivers whose kernel does nothing. It works on any driver. `tools/drivers layer` builds it; docs/drivers.md describes it.
//
//   ECHOLUME_LAYER_REPORT=FILE       appends a line of JSON per device: commands, submissions, memory by type and by use of its buffers
//   ECHOLUME_LAYER_LOG=FILE          appends every begin, bind, dispatch, barrier, time stamp and submission
//   ECHOLUME_LAYER_HANG=N            the Nth submission of a device and all later ones never complete; only the first device that gets there.
//                                    SIGALRM ends a program that is still running 45 s later, so that a missing deadline fails a test
//   ECHOLUME_LAYER_FAULT=FILE        while the program runs: FILE that begins with l loses, and with h hangs, the device that submits next; it is
//                                    deleted by that. A program that is hung in this way is not ended
//   ECHOLUME_LAYER_LOSE_WAIT=N       the Nth wait of a device loses it; only the first device that gets there
//   ECHOLUME_LAYER_DROP_BARRIERS=N   memory barriers are dropped from the Nth of a device on
//   ECHOLUME_LAYER_DROP_WAITS=1      submissions do not wait for semaphores
//   ECHOLUME_LAYER_MAX_GROUPS=N      a submission with a dispatch of more than N workgroups loses the device, as a watchdog would
//   ECHOLUME_LAYER_MEMORY=uncached   three memory types: device local; host visible and coherent, not cached; host visible and cached, not
//                                    coherent, where the host sees the device's writes only after an invalidation and the device the host's only
//                                    after a flush. For a driver whose memory types are all host visible, such as lavapipe.
//   ECHOLUME_LAYER_MAX_BUFFER=BYTES  the limit maxBufferSize; a larger buffer is refused
//   ECHOLUME_LAYER_COMPLETE=1        submissions complete at once, and time stamps that nobody wrote are made up
#define _GNU_SOURCE
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#define ARRAY(a) (sizeof(a) / sizeof((a)[0]))
#define U(handle) ((uint64_t)(uintptr_t)(handle))

// A table from handles to values: open addressing, grows, never shrinks. A value of 0 is none.
typedef struct {
    uint64_t *keys, *values;
    size_t used, capacity;
} Table;

static uint64_t *find(Table *t, uint64_t key) {
    if (t->used * 2 >= t->capacity) {
        Table old = *t;
        t->capacity = old.capacity ? old.capacity * 2 : 1024;
        t->keys = calloc(t->capacity, 8);
        t->values = calloc(t->capacity, 8);
        if (!t->keys || !t->values) abort();
        t->used = 0;
        for (size_t i = 0; i < old.capacity; i++)
            if (old.keys[i]) *find(t, old.keys[i]) = old.values[i];
        free(old.keys);
        free(old.values);
    }
    size_t i = (key * 0x9E3779B97F4A7C15ull >> 20) & (t->capacity - 1);
    while (t->keys[i] && t->keys[i] != key) i = (i + 1) & (t->capacity - 1);
    if (!t->keys[i]) t->keys[i] = key, t->used++;
    return &t->values[i];
}

static void clear(Table *t) {
    free(t->keys);
    free(t->values);
    memset(t, 0, sizeof *t);
}

typedef struct {
    void *key;
    VkInstance handle;
    PFN_vkGetInstanceProcAddr next;
    // Asked while the instance is made: afterwards the loader answers with the first layer's functions, which are these.
    PFN_vkDestroyInstance destroy;
    PFN_vkGetPhysicalDeviceProperties properties;
    PFN_vkGetPhysicalDeviceProperties2 properties2;
    PFN_vkGetPhysicalDeviceMemoryProperties memory;
    PFN_vkGetPhysicalDeviceMemoryProperties2 memory2;
} Instance;

// Memory of the emulated type that is cached and not coherent: the host maps a copy.
typedef struct {
    VkDeviceMemory memory;
    char *real, *copy;
    VkDeviceSize offset, size, allocated;
} Mapping;

typedef struct {
    void *key;
    VkDevice handle;
    PFN_vkGetDeviceProcAddr next;
    VkPhysicalDeviceMemoryProperties memory;
    char name[VK_MAX_PHYSICAL_DEVICE_NAME_SIZE];
    uint64_t dispatches, groups, largest, barriers, dropped, submissions, swallowed, pipelines, allocations, invalidations, flushes, stamps, too_large;
    uint64_t idle_while_hung, destroyed_while_hung, waits;
    double pipeline_ms, submit_ms;
    int hangs, lost;
    uint64_t bytes[VK_MAX_MEMORY_TYPES], count[VK_MAX_MEMORY_TYPES];
    struct {
        uint32_t type, usage;
        uint64_t count, bytes;
    } uses[128];
    // Names of objects; usage and size of buffers; memory type and size of allocations; the largest dispatch of command buffers; values of timelines.
    Table names, usage, size, type, allocated, groups_of, timelines;
    Mapping mappings[256];
} Device;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static Instance instances[64];
static Device *devices[256];
static int is_hung_once, is_lost_once;

static void *key_of(const void *handle) { return *(void **)handle; }

static Instance *instance_of(const void *handle) {
    pthread_mutex_lock(&lock);
    Instance *found = NULL;
    for (size_t i = 0; i < ARRAY(instances); i++)
        if (instances[i].key == key_of(handle)) found = &instances[i];
    pthread_mutex_unlock(&lock);
    if (!found) abort();
    return found;
}

static Device *device_of(const void *handle) {
    pthread_mutex_lock(&lock);
    Device *found = NULL;
    for (size_t i = 0; i < ARRAY(devices); i++)
        if (devices[i] && devices[i]->key == key_of(handle)) found = devices[i];
    pthread_mutex_unlock(&lock);
    if (!found) abort();
    return found;
}

#define NEXT(device, f) ((PFN_##f)(device)->next((device)->handle, #f))

static uint64_t number(const char *variable) {
    const char *text = getenv(variable);
    return text ? strtoull(text, NULL, 10) : 0;
}

static int is_memory_emulated(void) {
    const char *text = getenv("ECHOLUME_LAYER_MEMORY");
    return text && !strcmp(text, "uncached");
}

static double now_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1e3 + t.tv_nsec / 1e6;
}

static void sleep_ns(uint64_t ns) {
    struct timespec t = {(time_t)(ns / 1000000000u), (long)(ns % 1000000000u)};
    nanosleep(&t, NULL);
}

__attribute__((format(printf, 1, 2))) static void note(const char *format, ...) {
    static FILE *file;
    const char *path = getenv("ECHOLUME_LAYER_LOG");
    if (!path) return;
    pthread_mutex_lock(&lock);
    if (!file) file = fopen(path, "a");
    if (file) {
        va_list arguments;
        va_start(arguments, format);
        vfprintf(file, format, arguments);
        va_end(arguments);
        fflush(file);
    }
    pthread_mutex_unlock(&lock);
}

static const char *name_of(Device *d, uint64_t handle) {
    pthread_mutex_lock(&lock);
    const char *name = (const char *)(uintptr_t)*find(&d->names, handle);
    pthread_mutex_unlock(&lock);
    return name ? name : "?";
}

static void report(Device *d) {
    const char *path = getenv("ECHOLUME_LAYER_REPORT");
    FILE *o = path ? fopen(path, "a") : NULL;
    if (!o) return;
    fprintf(o, "{\"device\":\"%s\",\"dispatches\":%lu,\"groups\":%lu,\"largest_dispatch\":%lu,\"barriers\":%lu,\"dropped_barriers\":%lu,", d->name,
            d->dispatches, d->groups, d->largest, d->barriers, d->dropped);
    fprintf(o, "\"submissions\":%lu,\"swallowed_submissions\":%lu,\"submit_ms\":%.2f,\"pipelines\":%lu,\"pipeline_ms\":%.1f,\"stamps\":%lu,", d->submissions,
            d->swallowed, d->submit_ms, d->pipelines, d->pipeline_ms, d->stamps);
    fprintf(o, "\"allocations\":%lu,\"invalidations\":%lu,\"flushes\":%lu,\"refused_buffers\":%lu,", d->allocations, d->invalidations, d->flushes,
            d->too_large);
    fprintf(o, "\"waits\":%lu,\"hung\":%s,\"lost\":%s,\"idle_while_hung\":%lu,\"destroyed_while_hung\":%lu,\"memory\":[", d->waits, d->hangs ? "true" : "false",
            d->lost ? "true" : "false", d->idle_while_hung, d->destroyed_while_hung);
    int first = 1;
    for (uint32_t i = 0; i < d->memory.memoryTypeCount; i++) {
        if (!d->count[i]) continue;
        VkMemoryPropertyFlags f = d->memory.memoryTypes[i].propertyFlags;
        fprintf(o, "%s{\"type\":%u,\"device_local\":%s,\"host_visible\":%s,\"coherent\":%s,\"cached\":%s,\"allocations\":%lu,\"bytes\":%lu}", first ? "" : ",", i,
                f & 1 ? "true" : "false", f & 2 ? "true" : "false", f & 4 ? "true" : "false", f & 8 ? "true" : "false", d->count[i], d->bytes[i]);
        first = 0;
    }
    fprintf(o, "],\"buffers\":[");
    for (size_t i = 0; i < ARRAY(d->uses) && d->uses[i].count; i++) {
        uint32_t u = d->uses[i].usage;
        fprintf(o, "%s{\"type\":%u,\"transfer_src\":%s,\"transfer_dst\":%s,\"uniform\":%s,\"texels\":%s,\"count\":%lu,\"bytes\":%lu}", i ? "," : "", d->uses[i].type,
                u & VK_BUFFER_USAGE_TRANSFER_SRC_BIT ? "true" : "false", u & VK_BUFFER_USAGE_TRANSFER_DST_BIT ? "true" : "false",
                u & VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT ? "true" : "false",
                u & (VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT) ? "true" : "false", d->uses[i].count, d->uses[i].bytes);
    }
    fprintf(o, "]}\n");
    fclose(o);
}

// A device that hangs is never destroyed: its report is written when the program ends.
__attribute__((destructor)) static void report_rest(void) {
    for (size_t i = 0; i < ARRAY(devices); i++)
        if (devices[i]) report(devices[i]);
}

// ---- Memory ----

static void emulate_types(VkPhysicalDeviceMemoryProperties *p) {
    if (!is_memory_emulated()) return;
    p->memoryTypeCount = 3;
    p->memoryTypes[0] = (VkMemoryType){VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0};
    p->memoryTypes[1] = (VkMemoryType){VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, 0};
    p->memoryTypes[2] = (VkMemoryType){VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, 0};
}

static void emulate_bits(VkMemoryRequirements *r) {
    if (is_memory_emulated()) r->memoryTypeBits = 7;
}

static VKAPI_ATTR void VKAPI_CALL GetMemoryProperties(VkPhysicalDevice p, VkPhysicalDeviceMemoryProperties *out) {
    instance_of(p)->memory(p, out);
    emulate_types(out);
}

static VKAPI_ATTR void VKAPI_CALL GetMemoryProperties2(VkPhysicalDevice p, VkPhysicalDeviceMemoryProperties2 *out) {
    instance_of(p)->memory2(p, out);
    emulate_types(&out->memoryProperties);
}

static VKAPI_ATTR void VKAPI_CALL GetProperties2(VkPhysicalDevice p, VkPhysicalDeviceProperties2 *out) {
    instance_of(p)->properties2(p, out);
    uint64_t most = number("ECHOLUME_LAYER_MAX_BUFFER");
    for (VkBaseOutStructure *s = out->pNext; s && most; s = s->pNext) {
        if (s->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_PROPERTIES) ((VkPhysicalDeviceVulkan13Properties *)s)->maxBufferSize = most;
        if (s->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES)
            ((VkPhysicalDeviceMaintenance4Properties *)s)->maxBufferSize = most;
    }
}

static VKAPI_ATTR void VKAPI_CALL BufferRequirements(VkDevice h, VkBuffer b, VkMemoryRequirements *r) {
    NEXT(device_of(h), vkGetBufferMemoryRequirements)(h, b, r);
    emulate_bits(r);
}

static VKAPI_ATTR void VKAPI_CALL ImageRequirements(VkDevice h, VkImage i, VkMemoryRequirements *r) {
    NEXT(device_of(h), vkGetImageMemoryRequirements)(h, i, r);
    emulate_bits(r);
}

static VKAPI_ATTR void VKAPI_CALL BufferRequirements2(VkDevice h, const VkBufferMemoryRequirementsInfo2 *i, VkMemoryRequirements2 *r) {
    NEXT(device_of(h), vkGetBufferMemoryRequirements2)(h, i, r);
    emulate_bits(&r->memoryRequirements);
}

static VKAPI_ATTR void VKAPI_CALL ImageRequirements2(VkDevice h, const VkImageMemoryRequirementsInfo2 *i, VkMemoryRequirements2 *r) {
    NEXT(device_of(h), vkGetImageMemoryRequirements2)(h, i, r);
    emulate_bits(&r->memoryRequirements);
}

static VKAPI_ATTR void VKAPI_CALL DeviceBufferRequirements(VkDevice h, const VkDeviceBufferMemoryRequirements *i, VkMemoryRequirements2 *r) {
    NEXT(device_of(h), vkGetDeviceBufferMemoryRequirements)(h, i, r);
    emulate_bits(&r->memoryRequirements);
}

static VKAPI_ATTR void VKAPI_CALL DeviceImageRequirements(VkDevice h, const VkDeviceImageMemoryRequirements *i, VkMemoryRequirements2 *r) {
    NEXT(device_of(h), vkGetDeviceImageMemoryRequirements)(h, i, r);
    emulate_bits(&r->memoryRequirements);
}

static VKAPI_ATTR VkResult VKAPI_CALL Allocate(VkDevice h, const VkMemoryAllocateInfo *info, const VkAllocationCallbacks *a, VkDeviceMemory *m) {
    Device *d = device_of(h);
    VkMemoryAllocateInfo real = *info;
    if (is_memory_emulated()) real.memoryTypeIndex = 0;
    VkResult result = NEXT(d, vkAllocateMemory)(h, &real, a, m);
    if (result != VK_SUCCESS) return result;
    pthread_mutex_lock(&lock);
    d->allocations++;
    d->count[info->memoryTypeIndex]++;
    d->bytes[info->memoryTypeIndex] += info->allocationSize;
    *find(&d->type, U(*m)) = info->memoryTypeIndex;
    *find(&d->allocated, U(*m)) = info->allocationSize;
    pthread_mutex_unlock(&lock);
    return result;
}

static Mapping *mapping_of(Device *d, VkDeviceMemory m) {
    for (size_t i = 0; i < ARRAY(d->mappings); i++)
        if (d->mappings[i].memory == m) return &d->mappings[i];
    return NULL;
}

static VKAPI_ATTR VkResult VKAPI_CALL Map(VkDevice h, VkDeviceMemory m, VkDeviceSize offset, VkDeviceSize size, VkMemoryMapFlags f, void **p) {
    Device *d = device_of(h);
    pthread_mutex_lock(&lock);
    uint64_t type = *find(&d->type, U(m)), allocated = *find(&d->allocated, U(m));
    pthread_mutex_unlock(&lock);
    if (!is_memory_emulated()) return NEXT(d, vkMapMemory)(h, m, offset, size, f, p);
    if (type == 0) return VK_ERROR_MEMORY_MAP_FAILED;
    VkResult result = NEXT(d, vkMapMemory)(h, m, offset, size, f, p);
    if (type == 1 || result != VK_SUCCESS) return result;
    pthread_mutex_lock(&lock);
    Mapping *mapping = mapping_of(d, VK_NULL_HANDLE);
    if (mapping) {
        VkDeviceSize length = size == VK_WHOLE_SIZE ? allocated - offset : size;
        *mapping = (Mapping){m, *p, malloc(length), offset, length, allocated};
        // What was never invalidated is recognisably wrong.
        memset(mapping->copy, 0xCD, length);
        *p = mapping->copy;
    }
    pthread_mutex_unlock(&lock);
    return mapping ? VK_SUCCESS : VK_ERROR_MEMORY_MAP_FAILED;
}

static void forget_mapping(Device *d, VkDeviceMemory m) {
    pthread_mutex_lock(&lock);
    Mapping *mapping = mapping_of(d, m);
    if (m && mapping) {
        free(mapping->copy);
        memset(mapping, 0, sizeof *mapping);
    }
    pthread_mutex_unlock(&lock);
}

static VKAPI_ATTR void VKAPI_CALL Unmap(VkDevice h, VkDeviceMemory m) {
    forget_mapping(device_of(h), m);
    NEXT(device_of(h), vkUnmapMemory)(h, m);
}

// Copies a range between the driver's memory and what the host sees.
static void move(Device *d, uint32_t n, const VkMappedMemoryRange *r, int to_host) {
    pthread_mutex_lock(&lock);
    for (uint32_t i = 0; i < n; i++) {
        Mapping *m = mapping_of(d, r[i].memory);
        if (!m) continue;
        VkDeviceSize end = r[i].size == VK_WHOLE_SIZE ? m->offset + m->size : r[i].offset + r[i].size;
        VkDeviceSize begin = r[i].offset > m->offset ? r[i].offset - m->offset : 0;
        end = (end > m->offset + m->size ? m->offset + m->size : end) - m->offset;
        if (end > begin) memcpy(to_host ? m->copy + begin : m->real + begin, to_host ? m->real + begin : m->copy + begin, end - begin);
    }
    pthread_mutex_unlock(&lock);
}

static VKAPI_ATTR VkResult VKAPI_CALL Invalidate(VkDevice h, uint32_t n, const VkMappedMemoryRange *r) {
    Device *d = device_of(h);
    d->invalidations += n;
    VkResult result = NEXT(d, vkInvalidateMappedMemoryRanges)(h, n, r);
    move(d, n, r, 1);
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL Flush(VkDevice h, uint32_t n, const VkMappedMemoryRange *r) {
    Device *d = device_of(h);
    d->flushes += n;
    move(d, n, r, 0);
    return NEXT(d, vkFlushMappedMemoryRanges)(h, n, r);
}

static VKAPI_ATTR VkResult VKAPI_CALL CreateBuffer(VkDevice h, const VkBufferCreateInfo *i, const VkAllocationCallbacks *a, VkBuffer *b) {
    Device *d = device_of(h);
    uint64_t most = number("ECHOLUME_LAYER_MAX_BUFFER");
    if (most && i->size > most) {
        d->too_large++;
        return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    }
    VkResult result = NEXT(d, vkCreateBuffer)(h, i, a, b);
    if (result != VK_SUCCESS) return result;
    pthread_mutex_lock(&lock);
    *find(&d->usage, U(*b)) = i->usage;
    *find(&d->size, U(*b)) = i->size;
    pthread_mutex_unlock(&lock);
    return result;
}

static void bound(Device *d, VkBuffer b, VkDeviceMemory m) {
    pthread_mutex_lock(&lock);
    uint32_t usage = (uint32_t)*find(&d->usage, U(b)), type = (uint32_t)*find(&d->type, U(m));
    for (size_t i = 0; i < ARRAY(d->uses); i++) {
        if (d->uses[i].count && (d->uses[i].type != type || d->uses[i].usage != usage)) continue;
        d->uses[i].type = type;
        d->uses[i].usage = usage;
        d->uses[i].count++;
        d->uses[i].bytes += *find(&d->size, U(b));
        break;
    }
    pthread_mutex_unlock(&lock);
}

static VKAPI_ATTR VkResult VKAPI_CALL BindBuffer(VkDevice h, VkBuffer b, VkDeviceMemory m, VkDeviceSize o) {
    bound(device_of(h), b, m);
    return NEXT(device_of(h), vkBindBufferMemory)(h, b, m, o);
}

static VKAPI_ATTR VkResult VKAPI_CALL BindBuffer2(VkDevice h, uint32_t n, const VkBindBufferMemoryInfo *i) {
    for (uint32_t j = 0; j < n; j++) bound(device_of(h), i[j].buffer, i[j].memory);
    return NEXT(device_of(h), vkBindBufferMemory2)(h, n, i);
}

// ---- Destruction while work is pending is an error that drivers do not report ----

static int is_hung(Device *d) { return d->hangs && d->swallowed; }

static VKAPI_ATTR void VKAPI_CALL FreeMemory(VkDevice h, VkDeviceMemory m, const VkAllocationCallbacks *a) {
    Device *d = device_of(h);
    d->destroyed_while_hung += m && is_hung(d);
    forget_mapping(d, m);
    NEXT(d, vkFreeMemory)(h, m, a);
}

#define DESTROY(Name, Type)                                                                                                                          \
    static VKAPI_ATTR void VKAPI_CALL Destroy##Name(VkDevice h, Type o, const VkAllocationCallbacks *a) {                                           \
        Device *d = device_of(h);                                                                                                                    \
        d->destroyed_while_hung += o && is_hung(d);                                                                                                  \
        NEXT(d, vkDestroy##Name)(h, o, a);                                                                                                           \
    }
DESTROY(Buffer, VkBuffer)
DESTROY(Image, VkImage)
DESTROY(ImageView, VkImageView)
DESTROY(Pipeline, VkPipeline)
DESTROY(CommandPool, VkCommandPool)
DESTROY(DescriptorPool, VkDescriptorPool)
DESTROY(QueryPool, VkQueryPool)
DESTROY(Semaphore, VkSemaphore)

// ---- Commands ----

static VKAPI_ATTR VkResult VKAPI_CALL SetName(VkDevice h, const VkDebugUtilsObjectNameInfoEXT *i) {
    Device *d = device_of(h);
    if (i->pObjectName && (i->objectType == VK_OBJECT_TYPE_PIPELINE || i->objectType == VK_OBJECT_TYPE_COMMAND_BUFFER)) {
        pthread_mutex_lock(&lock);
        uint64_t *name = find(&d->names, i->objectHandle);
        free((void *)(uintptr_t)*name);
        *name = U(strdup(i->pObjectName));
        pthread_mutex_unlock(&lock);
    }
    PFN_vkSetDebugUtilsObjectNameEXT next = NEXT(d, vkSetDebugUtilsObjectNameEXT);
    return next ? next(h, i) : VK_SUCCESS;
}

static VKAPI_ATTR VkResult VKAPI_CALL Begin(VkCommandBuffer c, const VkCommandBufferBeginInfo *i) {
    Device *d = device_of(c);
    pthread_mutex_lock(&lock);
    *find(&d->groups_of, U(c)) = 0;
    pthread_mutex_unlock(&lock);
    note("begin %s\n", name_of(d, U(c)));
    return NEXT(d, vkBeginCommandBuffer)(c, i);
}

static VKAPI_ATTR void VKAPI_CALL BindPipeline(VkCommandBuffer c, VkPipelineBindPoint b, VkPipeline p) {
    note("bind %s\n", name_of(device_of(c), U(p)));
    NEXT(device_of(c), vkCmdBindPipeline)(c, b, p);
}

static void dispatched(VkCommandBuffer c, uint64_t x, uint64_t y, uint64_t z) {
    Device *d = device_of(c);
    uint64_t groups = x * y * z;
    pthread_mutex_lock(&lock);
    d->dispatches++;
    d->groups += groups;
    if (groups > d->largest) d->largest = groups;
    uint64_t *most = find(&d->groups_of, U(c));
    if (groups > *most) *most = groups;
    pthread_mutex_unlock(&lock);
    note("dispatch %lu %lu %lu\n", x, y, z);
}

static VKAPI_ATTR void VKAPI_CALL Dispatch(VkCommandBuffer c, uint32_t x, uint32_t y, uint32_t z) {
    dispatched(c, x, y, z);
    NEXT(device_of(c), vkCmdDispatch)(c, x, y, z);
}

static VKAPI_ATTR void VKAPI_CALL DispatchBase(VkCommandBuffer c, uint32_t bx, uint32_t by, uint32_t bz, uint32_t x, uint32_t y, uint32_t z) {
    dispatched(c, x, y, z);
    NEXT(device_of(c), vkCmdDispatchBase)(c, bx, by, bz, x, y, z);
}

static VKAPI_ATTR void VKAPI_CALL Stamp(VkCommandBuffer c, VkPipelineStageFlags2 s, VkQueryPool q, uint32_t n) {
    Device *d = device_of(c);
    d->stamps++;
    note("stamp %u\n", n);
    NEXT(d, vkCmdWriteTimestamp2)(c, s, q, n);
}

static VKAPI_ATTR void VKAPI_CALL PipelineBarrier2(VkCommandBuffer c, const VkDependencyInfo *i) {
    Device *d = device_of(c);
    uint64_t from = number("ECHOLUME_LAYER_DROP_BARRIERS");
    VkDependencyInfo kept = *i;
    if (i->memoryBarrierCount) {
        const VkMemoryBarrier2 *m = i->pMemoryBarriers;
        note("barrier %#lx %#lx %#lx %#lx\n", m->srcStageMask, m->srcAccessMask, m->dstStageMask, m->dstAccessMask);
        pthread_mutex_lock(&lock);
        d->barriers++;
        if (from && d->barriers >= from) d->dropped++, kept.memoryBarrierCount = 0;
        pthread_mutex_unlock(&lock);
    }
    if (kept.memoryBarrierCount || kept.bufferMemoryBarrierCount || kept.imageMemoryBarrierCount) NEXT(d, vkCmdPipelineBarrier2)(c, &kept);
}

static VKAPI_ATTR VkResult VKAPI_CALL CreatePipelines(VkDevice h, VkPipelineCache cache, uint32_t n, const VkComputePipelineCreateInfo *i,
                                                      const VkAllocationCallbacks *a, VkPipeline *p) {
    Device *d = device_of(h);
    double begin = now_ms();
    VkResult result = NEXT(d, vkCreateComputePipelines)(h, cache, n, i, a, p);
    pthread_mutex_lock(&lock);
    d->pipeline_ms += now_ms() - begin;
    d->pipelines += n;
    pthread_mutex_unlock(&lock);
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL QueryResults(VkDevice h, VkQueryPool q, uint32_t first, uint32_t n, size_t size, void *p, VkDeviceSize stride,
                                                   VkQueryResultFlags f) {
    VkResult result = NEXT(device_of(h), vkGetQueryPoolResults)(h, q, first, n, size, p, stride, f);
    if (result != VK_NOT_READY || !number("ECHOLUME_LAYER_COMPLETE") || !(f & VK_QUERY_RESULT_64_BIT)) return result;
    static uint64_t ticks = 1000;
    pthread_mutex_lock(&lock);
    for (uint32_t i = 0; i < n; i++) memcpy((char *)p + i * stride, &(uint64_t){ticks += 1000}, 8);
    pthread_mutex_unlock(&lock);
    return VK_SUCCESS;
}

// ---- Submissions and waits ----

static int largest_groups(Device *d, uint32_t n, const VkSubmitInfo2 *s, uint64_t limit) {
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < s[i].commandBufferInfoCount; j++)
            if (*find(&d->groups_of, U(s[i].pCommandBufferInfos[j].commandBuffer)) > limit) return 1;
    return 0;
}

// The first letter of the file that asks for a fault now, 0 without one. It is taken once.
static int asked(void) {
    const char *path = getenv("ECHOLUME_LAYER_FAULT");
    FILE *file = path ? fopen(path, "r") : NULL;
    if (!file) return 0;
    int letter = fgetc(file);
    fclose(file);
    return unlink(path) == 0 ? letter : 0;
}

static VKAPI_ATTR VkResult VKAPI_CALL Submit2(VkQueue q, uint32_t n, const VkSubmitInfo2 *s, VkFence f) {
    Device *d = device_of(q);
    uint64_t hang = number("ECHOLUME_LAYER_HANG"), most = number("ECHOLUME_LAYER_MAX_GROUPS");
    note("submit\n");
    pthread_mutex_lock(&lock);
    d->submissions += n;
    if (most && largest_groups(d, n, s, most)) d->lost = 1;
    if (hang && d->submissions >= hang && !is_hung_once) {
        d->hangs = is_hung_once = 1;
        alarm(45);
    }
    int fault = asked();
    if (fault == 'l') d->lost = 1;
    if (fault == 'h') d->hangs = 1;
    int swallowed = d->hangs;
    d->swallowed += swallowed ? n : 0;
    if (!swallowed && number("ECHOLUME_LAYER_COMPLETE"))
        for (uint32_t i = 0; i < n; i++)
            for (uint32_t j = 0; j < s[i].signalSemaphoreInfoCount; j++) {
                uint64_t *value = find(&d->timelines, U(s[i].pSignalSemaphoreInfos[j].semaphore));
                if (s[i].pSignalSemaphoreInfos[j].value > *value) *value = s[i].pSignalSemaphoreInfos[j].value;
            }
    pthread_mutex_unlock(&lock);
    if (d->lost) {
        // A device that is lost runs nothing any more, and the program may destroy what earlier submissions use.
        NEXT(d, vkQueueWaitIdle)(q);
        return VK_ERROR_DEVICE_LOST;
    }
    if (swallowed) return VK_SUCCESS;
    VkSubmitInfo2 *copies = malloc(n * sizeof *copies);
    if (n) memcpy(copies, s, n * sizeof *copies);
    for (uint32_t i = 0; i < n && number("ECHOLUME_LAYER_DROP_WAITS"); i++) copies[i].waitSemaphoreInfoCount = 0;
    double begin = now_ms();
    VkResult result = NEXT(d, vkQueueSubmit2)(q, n, copies, f);
    pthread_mutex_lock(&lock);
    d->submit_ms += now_ms() - begin;
    pthread_mutex_unlock(&lock);
    free(copies);
    return result;
}

// Tells validation, below this layer, that work is done. A kernel that does nothing does not wait either.
static void tell_done(Device *d, const VkSemaphoreWaitInfo *w) { NEXT(d, vkWaitSemaphores)(d->handle, w, UINT64_MAX); }

static VKAPI_ATTR VkResult VKAPI_CALL Counter(VkDevice h, VkSemaphore s, uint64_t *value) {
    Device *d = device_of(h);
    if (d->lost) return VK_ERROR_DEVICE_LOST;
    if (!number("ECHOLUME_LAYER_COMPLETE")) return NEXT(d, vkGetSemaphoreCounterValue)(h, s, value);
    // A kernel that does nothing leaves what it should answer as it was: any value.
    pthread_mutex_lock(&lock);
    *value = *find(&d->timelines, U(s));
    pthread_mutex_unlock(&lock);
    if (*value) tell_done(d, &(VkSemaphoreWaitInfo){VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, .semaphoreCount = 1, .pSemaphores = &s, .pValues = value});
    return VK_SUCCESS;
}

static VKAPI_ATTR VkResult VKAPI_CALL WaitSemaphores(VkDevice h, const VkSemaphoreWaitInfo *w, uint64_t timeout) {
    Device *d = device_of(h);
    uint64_t last = number("ECHOLUME_LAYER_LOSE_WAIT");
    pthread_mutex_lock(&lock);
    int is_last = ++d->waits == last && !is_lost_once;
    if (is_last) d->lost = is_lost_once = 1;
    pthread_mutex_unlock(&lock);
    // As in a submission: the program may destroy what earlier ones use.
    if (is_last) NEXT(d, vkDeviceWaitIdle)(h);
    if (d->lost) return VK_ERROR_DEVICE_LOST;
    if (!number("ECHOLUME_LAYER_COMPLETE")) return NEXT(d, vkWaitSemaphores)(h, w, timeout);
    double begin = now_ms();
    for (;;) {
        uint32_t reached = 0;
        for (uint32_t i = 0; i < w->semaphoreCount; i++) {
            uint64_t value = 0;
            VkResult result = Counter(h, w->pSemaphores[i], &value);
            if (result != VK_SUCCESS) return result;
            reached += value >= w->pValues[i];
        }
        if (reached == w->semaphoreCount || (reached && (w->flags & VK_SEMAPHORE_WAIT_ANY_BIT))) {
            tell_done(d, w);
            return VK_SUCCESS;
        }
        if ((now_ms() - begin) * 1e6 >= (double)timeout) return VK_TIMEOUT;
        sleep_ns(1000000);
    }
}

// A device that hangs is never idle.
static VkResult idle(Device *d) {
    if (d->lost) return VK_ERROR_DEVICE_LOST;
    if (!is_hung(d)) return VK_SUCCESS;
    d->idle_while_hung++;
    for (;;) sleep_ns(1000000000);
}

static VKAPI_ATTR VkResult VKAPI_CALL DeviceWaitIdle(VkDevice h) {
    VkResult result = idle(device_of(h));
    return result == VK_SUCCESS ? NEXT(device_of(h), vkDeviceWaitIdle)(h) : result;
}

static VKAPI_ATTR VkResult VKAPI_CALL QueueWaitIdle(VkQueue q) {
    VkResult result = idle(device_of(q));
    return result == VK_SUCCESS ? NEXT(device_of(q), vkQueueWaitIdle)(q) : result;
}

// A picture that waits for work that hangs stays in the queue. lavapipe would wait in the call until that work is submitted.
static VKAPI_ATTR VkResult VKAPI_CALL QueuePresent(VkQueue q, const VkPresentInfoKHR *i) {
    if (!is_hung(device_of(q))) return NEXT(device_of(q), vkQueuePresentKHR)(q, i);
    for (uint32_t j = 0; i->pResults && j < i->swapchainCount; j++) i->pResults[j] = VK_SUCCESS;
    return VK_SUCCESS;
}

// ---- Instance and device ----

static VKAPI_ATTR void VKAPI_CALL DestroyDevice(VkDevice h, const VkAllocationCallbacks *a) {
    if (!h) return;
    Device *d = device_of(h);
    d->destroyed_while_hung += is_hung(d);
    report(d);
    PFN_vkDestroyDevice next = NEXT(d, vkDestroyDevice);
    pthread_mutex_lock(&lock);
    for (size_t i = 0; i < ARRAY(devices); i++)
        if (devices[i] == d) devices[i] = NULL;
    for (size_t i = 0; i < d->names.capacity; i++) free((void *)(uintptr_t)d->names.values[i]);
    Table *tables[] = {&d->names, &d->usage, &d->size, &d->type, &d->allocated, &d->groups_of, &d->timelines};
    for (size_t i = 0; i < ARRAY(tables); i++) clear(tables[i]);
    pthread_mutex_unlock(&lock);
    next(h, a);
    free(d);
}

static VKAPI_ATTR VkResult VKAPI_CALL CreateDevice(VkPhysicalDevice p, const VkDeviceCreateInfo *info, const VkAllocationCallbacks *a, VkDevice *h) {
    Instance *instance = instance_of(p);
    VkLayerDeviceCreateInfo *link = (VkLayerDeviceCreateInfo *)info->pNext;
    while (link && !(link->sType == VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO && link->function == VK_LAYER_LINK_INFO))
        link = (VkLayerDeviceCreateInfo *)link->pNext;
    if (!link) return VK_ERROR_INITIALIZATION_FAILED;
    PFN_vkGetInstanceProcAddr next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    PFN_vkGetDeviceProcAddr next_device = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    VkResult result = ((PFN_vkCreateDevice)next(instance->handle, "vkCreateDevice"))(p, info, a, h);
    if (result != VK_SUCCESS) return result;
    Device *d = calloc(1, sizeof *d);
    if (!d) abort();
    d->key = key_of(*h);
    d->handle = *h;
    d->next = next_device;
    GetMemoryProperties(p, &d->memory);
    VkPhysicalDeviceProperties properties;
    instance->properties(p, &properties);
    memcpy(d->name, properties.deviceName, sizeof d->name);
    for (char *c = d->name; *c; c++)
        if (*c == '"' || *c == '\\' || (unsigned char)*c < ' ') *c = '?';
    pthread_mutex_lock(&lock);
    size_t i = 0;
    while (i < ARRAY(devices) && devices[i]) i++;
    if (i == ARRAY(devices)) abort();
    devices[i] = d;
    pthread_mutex_unlock(&lock);
    return VK_SUCCESS;
}

static VKAPI_ATTR VkResult VKAPI_CALL CreateInstance(const VkInstanceCreateInfo *info, const VkAllocationCallbacks *a, VkInstance *h) {
    VkLayerInstanceCreateInfo *link = (VkLayerInstanceCreateInfo *)info->pNext;
    while (link && !(link->sType == VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO && link->function == VK_LAYER_LINK_INFO))
        link = (VkLayerInstanceCreateInfo *)link->pNext;
    if (!link) return VK_ERROR_INITIALIZATION_FAILED;
    PFN_vkGetInstanceProcAddr next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    VkResult result = ((PFN_vkCreateInstance)next(NULL, "vkCreateInstance"))(info, a, h);
    if (result != VK_SUCCESS) return result;
    pthread_mutex_lock(&lock);
    size_t i = 0;
    while (i < ARRAY(instances) && instances[i].key) i++;
    if (i == ARRAY(instances)) abort();
#define OF(f) ((PFN_##f)next(*h, #f))
    instances[i] = (Instance){
        .key = key_of(*h),
        .handle = *h,
        .next = next,
        .destroy = OF(vkDestroyInstance),
        .properties = OF(vkGetPhysicalDeviceProperties),
        .properties2 = OF(vkGetPhysicalDeviceProperties2),
        .memory = OF(vkGetPhysicalDeviceMemoryProperties),
        .memory2 = OF(vkGetPhysicalDeviceMemoryProperties2),
    };
    pthread_mutex_unlock(&lock);
    return VK_SUCCESS;
}

static VKAPI_ATTR void VKAPI_CALL DestroyInstance(VkInstance h, const VkAllocationCallbacks *a) {
    if (!h) return;
    Instance *instance = instance_of(h);
    PFN_vkDestroyInstance next = instance->destroy;
    pthread_mutex_lock(&lock);
    memset(instance, 0, sizeof *instance);
    pthread_mutex_unlock(&lock);
    next(h, a);
}

#define IS(function) ((PFN_vkVoidFunction)(function))
static const struct {
    const char *name;
    PFN_vkVoidFunction function;
} of_device[] = {
    {"vkAllocateMemory", IS(Allocate)},
    {"vkBeginCommandBuffer", IS(Begin)},
    {"vkBindBufferMemory", IS(BindBuffer)},
    {"vkBindBufferMemory2", IS(BindBuffer2)},
    {"vkCmdBindPipeline", IS(BindPipeline)},
    {"vkCmdDispatch", IS(Dispatch)},
    {"vkCmdDispatchBase", IS(DispatchBase)},
    {"vkCmdPipelineBarrier2", IS(PipelineBarrier2)},
    {"vkCmdWriteTimestamp2", IS(Stamp)},
    {"vkCreateBuffer", IS(CreateBuffer)},
    {"vkCreateComputePipelines", IS(CreatePipelines)},
    {"vkDestroyBuffer", IS(DestroyBuffer)},
    {"vkDestroyCommandPool", IS(DestroyCommandPool)},
    {"vkDestroyDescriptorPool", IS(DestroyDescriptorPool)},
    {"vkDestroyDevice", IS(DestroyDevice)},
    {"vkDestroyImage", IS(DestroyImage)},
    {"vkDestroyImageView", IS(DestroyImageView)},
    {"vkDestroyPipeline", IS(DestroyPipeline)},
    {"vkDestroyQueryPool", IS(DestroyQueryPool)},
    {"vkDestroySemaphore", IS(DestroySemaphore)},
    {"vkDeviceWaitIdle", IS(DeviceWaitIdle)},
    {"vkFlushMappedMemoryRanges", IS(Flush)},
    {"vkFreeMemory", IS(FreeMemory)},
    {"vkGetBufferMemoryRequirements", IS(BufferRequirements)},
    {"vkGetBufferMemoryRequirements2", IS(BufferRequirements2)},
    {"vkGetDeviceBufferMemoryRequirements", IS(DeviceBufferRequirements)},
    {"vkGetDeviceImageMemoryRequirements", IS(DeviceImageRequirements)},
    {"vkGetImageMemoryRequirements", IS(ImageRequirements)},
    {"vkGetImageMemoryRequirements2", IS(ImageRequirements2)},
    {"vkGetQueryPoolResults", IS(QueryResults)},
    {"vkGetSemaphoreCounterValue", IS(Counter)},
    {"vkInvalidateMappedMemoryRanges", IS(Invalidate)},
    {"vkMapMemory", IS(Map)},
    {"vkQueueSubmit2", IS(Submit2)},
    {"vkQueueWaitIdle", IS(QueueWaitIdle)},
    {"vkQueuePresentKHR", IS(QueuePresent)},
    {"vkSetDebugUtilsObjectNameEXT", IS(SetName)},
    {"vkUnmapMemory", IS(Unmap)},
    {"vkWaitSemaphores", IS(WaitSemaphores)},
}, of_instance[] = {
    {"vkCreateDevice", IS(CreateDevice)},
    {"vkCreateInstance", IS(CreateInstance)},
    {"vkDestroyInstance", IS(DestroyInstance)},
    {"vkGetPhysicalDeviceMemoryProperties", IS(GetMemoryProperties)},
    {"vkGetPhysicalDeviceMemoryProperties2", IS(GetMemoryProperties2)},
    {"vkGetPhysicalDeviceProperties2", IS(GetProperties2)},
};

static PFN_vkVoidFunction own(const char *name) {
    for (size_t i = 0; i < ARRAY(of_device); i++)
        if (!strcmp(of_device[i].name, name)) return of_device[i].function;
    return NULL;
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL DeviceProcAddr(VkDevice h, const char *name) {
    if (!strcmp(name, "vkGetDeviceProcAddr")) return IS(DeviceProcAddr);
    Device *d = device_of(h);
    PFN_vkVoidFunction mine = own(name), next = d->next(h, name);
    // What the driver lacks stays missing; names of objects are kept for the log where nobody else wants them.
    return mine && (next || !strcmp(name, "vkSetDebugUtilsObjectNameEXT")) ? mine : next;
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL InstanceProcAddr(VkInstance h, const char *name) {
    if (!strcmp(name, "vkGetInstanceProcAddr")) return IS(InstanceProcAddr);
    if (!strcmp(name, "vkGetDeviceProcAddr")) return IS(DeviceProcAddr);
    for (size_t i = 0; i < ARRAY(of_instance); i++)
        if (!strcmp(of_instance[i].name, name)) return of_instance[i].function;
    PFN_vkVoidFunction mine = own(name);
    return mine ? mine : h ? instance_of(h)->next(h, name) : NULL;
}

__attribute__((visibility("default"))) VKAPI_ATTR VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface *v) {
    if (v->loaderLayerInterfaceVersion < 2) return VK_ERROR_INITIALIZATION_FAILED;
    v->loaderLayerInterfaceVersion = 2;
    v->pfnGetInstanceProcAddr = InstanceProcAddr;
    v->pfnGetDeviceProcAddr = DeviceProcAddr;
    v->pfnGetPhysicalDeviceProcAddr = NULL;
    return VK_SUCCESS;
}
