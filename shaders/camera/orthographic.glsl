// Provides camera_ray() of a parallel projection: all rays have one direction.

uniform vec3 u_camera_position;  // model space
uniform mat3 u_camera_axes;      // columns: right, up, back; unit, model space
uniform vec4 u_window;           // left, bottom, width of a pixel, height of a pixel; model lengths

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction) {
    origin = u_camera_position + u_camera_axes * vec3(u_window.xy + pixel * u_window.zw, 0.0);
    direction = -u_camera_axes[2];
}
